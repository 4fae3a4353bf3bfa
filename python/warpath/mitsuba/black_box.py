"""A scene and an integrator of Mitsuba as a function of primary samples."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from ..training import Layout
from .emission import pixels_that_may_see
from .numbers import Order, sampler_class


class BlackBox:
    """f(y), the radiance that a sample brings (linear RGB), without what the camera sees emitted directly.

    The rays are made here; the integrator gets them with a sampler that hands out y. What it returns holds the emission that
    its ray sees; that is found once more and taken off.
    """

    def __init__(self, scene: mi.Scene, sensor: mi.Sensor, integrator: mi.SamplingIntegrator, layout: Layout | None = None):
        self._scene, self._sensor, self._integrator = scene, sensor, integrator
        media = sensor.get_medium() is not None or any(s.interior_medium() is not None or s.exterior_medium() is not None for s in scene.shapes())
        self._order = Order(integrator, layout, media)
        self._size = np.array(sensor.film().crop_size(), int)
        self._scalar = mi.variant().startswith("scalar")
        # Hidden emitters are not in what the integrator returns, and through a medium the camera sees them dimmed.
        apart = not getattr(integrator, "hide_emitters", False) and sensor.get_medium() is None
        self.may_see = pixels_that_may_see(scene, sensor) if apart else np.zeros(self._size[::-1], bool)
        self._mask = None if self._scalar else mi.Bool(self.may_see.ravel())

    def evaluate(self, y: np.ndarray, seed: int, film: np.ndarray | None = None):
        """y: D x N; film: 2 x N in [0, 1) where the layout does not hold it (None: uniform).

        Returns positions on the film in pixels (2 x N) and f (3 x N), as arrays of the variant, and how many f were not finite;
        those are 0.
        """
        order = self._order
        if film is not None:
            order.camera["film"] = len(y)
            y = np.concatenate([y, film])
        sampler = sampler_class(mi.variant())()
        sampler.start(order, y, seed)
        if not self._scalar:
            return self._evaluate(sampler)
        position, value, bad = np.empty((2, y.shape[1]), np.float32), np.empty((3, y.shape[1]), np.float32), 0
        for i in range(y.shape[1]):
            sampler.go_to(i)
            p, f, one = self._evaluate(sampler)
            position[:, i], value[:, i] = p, f
            bad += one
        return position, value, bad

    def _evaluate(self, sampler):
        ray, weight, film = self._ray(sampler)
        value, _, _ = self._integrator.sample(self._scene, sampler, ray, self._sensor.get_medium())
        value -= self._emission(ray, film)
        value *= weight
        finite = dr.all(dr.isfinite(value))
        value = dr.select(finite, value, mi.Color3f(0))
        if self._scalar:
            return self._in_pixels(film), value, not finite
        dr.eval(value, finite)  # together: counting alone would trace the paths for that
        return self._in_pixels(film), value, value.shape[1] - int(dr.count(finite)[0])

    def emission(self, film: np.ndarray, seed: int):
        """What camera rays see emitted directly. film: 2 x N in [0, 1). Returns positions in pixels and radiance."""
        order = Order(self._integrator, None)
        order.camera["film"] = 0
        sampler = sampler_class(mi.variant())()
        sampler.start(order, film, seed)

        def one():
            ray, weight, place = self._ray(sampler)
            return self._in_pixels(place), self._emission(ray, place) * weight

        if not self._scalar:
            return one()
        position, value = np.empty_like(film), np.empty((3, film.shape[1]), np.float32)
        for i in range(film.shape[1]):
            sampler.go_to(i)
            position[:, i], value[:, i] = one()
        return position, value

    def _ray(self, sampler):
        camera, sensor = sampler.order.camera, self._sensor

        def numbers(name: str, size: int):
            if name in camera:
                values = [sampler.of_column(camera[name] + i) for i in range(size)]
            else:
                values = [sampler.random.next_float32() for _ in range(size)]
            return mi.Point2f(values) if size == 2 else values[0]

        film = numbers("film", 2)
        lens = numbers("lens", 2) if sensor.needs_aperture_sample() else mi.Point2f(0.5)
        time = sensor.shutter_open()
        if sensor.shutter_open_time() > 0:
            time = time + numbers("time", 1) * sensor.shutter_open_time()
        ray, weight = sensor.sample_ray_differential(time, 0.5, film, lens)
        return ray, weight, film

    def _emission(self, ray, film):
        """Radiance that the ray sees emitted, where it may see an emitter at all."""
        x, y = (dr.minimum(mi.UInt32(film[i] * float(self._size[i])), int(self._size[i]) - 1) for i in range(2))
        if self._scalar:
            active = bool(self.may_see[y, x])
        else:
            active = dr.gather(mi.Bool, self._mask, y * int(self._size[0]) + x)
        if self._scalar and not active:
            return mi.Color3f(0)
        si = self._scene.ray_intersect(ray, active)
        emitter = si.emitter(self._scene, active)
        if self._scalar and emitter is None:
            return mi.Color3f(0)
        return dr.select(active, emitter.eval(si, active), mi.Color3f(0))

    def _in_pixels(self, film):
        """Below the size, so that the filter of one pixel loses none at the border."""
        most = np.nextafter(self._size.astype(np.float32), np.float32(0))
        return mi.Point2f([dr.minimum(film[i] * float(self._size[i]), float(most[i])) for i in range(2)])
