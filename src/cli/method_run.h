#pragma once
#include "render/renderer.h"
#include "report/results.h"

namespace warpath {

/// What images are measured against.
struct References {
  Reference image;
  Reference rest;  ///< without directly seen emission
};

/// What results.json keeps of a render: what it did, what it cost, and its errors.
MethodRun measure(const Method& method, const RenderSettings& settings, const Rendered& rendered,
                  const References& references);

/// The error of the image so far, as a point of its curve.
ErrorPoint error_point(const Rendered& rendered, const Reference& reference);

}  // namespace warpath
