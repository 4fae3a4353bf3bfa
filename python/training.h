#pragma once
#include <nanobind/nanobind.h>

namespace warpath::python {

/// Candidates, training, and trained warps.
void bind_training(nanobind::module_& m);

}  // namespace warpath::python
