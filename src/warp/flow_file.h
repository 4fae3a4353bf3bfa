#pragma once
#include <string>

#include "core/tensor_file.h"
#include "warp/coupling_flow.h"

namespace warpath {

/// A whole number from the metadata of the proposal under `prefix`; throws FileError unless it is in [least, most].
int load_int(const TensorFile& file, const std::string& prefix, const char* key, int least, int most);

/// The shape of a spline flow, as metadata under `prefix`; its training is not a part of it.
void save_settings(TensorFile& file, const std::string& prefix, const SplineSettings& settings);
/// Throws FileError.
SplineSettings load_spline_settings(const TensorFile& file, const std::string& prefix);

/// Puts the parameters under `prefix` + the names of flow.views().
void save_parameters(TensorFile& file, const std::string& prefix, const CouplingFlow& flow,
                     const nn::AlignedVector<float>& parameters);
/// Reads them back; throws FileError if one is missing, has another shape or is not finite.
nn::AlignedVector<float> load_parameters(const TensorFile& file, const std::string& prefix, const CouplingFlow& flow);

}  // namespace warpath
