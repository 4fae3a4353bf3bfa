#pragma once
#include "render/renderer.h"
#include "report/results.h"

namespace warpath {

/// What results.json keeps of a render, but for its errors.
MethodRun method_run(const Method& method, const RenderSettings& settings, const Rendered& rendered);

/// The error of the image so far, as a point of its curve.
ErrorPoint error_point(const Rendered& rendered, const Reference& reference);

/// Errors against the references of the whole image, and of what is left without directly seen emission.
void set_errors(MethodRun& run, const ImageEstimate& image, const ImageRgb& rest, const Reference& reference,
                const Reference& reference_rest);

}  // namespace warpath
