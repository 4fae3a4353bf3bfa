#pragma once
#include <memory>
#include <string>

#include "core/tensor_file.h"

namespace warpath {

/// T::load as a function that returns a base of T, which is what families hold.
template <class Base, class T>
std::shared_ptr<const Base> load_as(const TensorFile& file, const std::string& prefix) {
  return T::load(file, prefix);
}

}  // namespace warpath
