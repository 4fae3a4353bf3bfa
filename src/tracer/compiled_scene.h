#pragma once
#include "tracer/camera.h"
#include "tracer/embree_scene.h"
#include "tracer/emitters.h"
#include "tracer/material.h"
#include "tracer/surface.h"

namespace warpath {

/// A scene made ready for rendering. The parts refer to each other and to `scene`, so it neither moves nor copies.
struct CompiledScene {
  explicit CompiledScene(Scene&& source)
      : scene(std::move(source)),
        materials(scene),
        surfaces(scene.shapes, materials),
        embree(scene.shapes, surfaces.analytic()),
        emitters(scene, surfaces.analytic(), materials),
        camera(scene.sensor, scene.film) {}
  CompiledScene(const CompiledScene&) = delete;
  CompiledScene& operator=(const CompiledScene&) = delete;

  bool uses_time() const { return camera.moves() || surfaces.any_moves(); }

  const Scene scene;
  const Materials materials;
  const Surfaces surfaces;
  const EmbreeScene embree;
  const Emitters emitters;
  const Camera camera;
};

}  // namespace warpath
