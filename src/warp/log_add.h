#pragma once
#include <cstddef>

namespace warpath {

/// a[i] = ln(e^a[i] + e^(b[i] + shift)), without overflow; -infinity stands for ln 0.
void log_add(std::size_t n, double* a, const double* b, double shift);

}  // namespace warpath
