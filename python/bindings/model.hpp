#pragma once

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "palpate/displacement.hpp"
#include "palpate/lattice.hpp"

namespace palpate::python {

/// "PoseLattice(x_mm=(-10, 10, 25), ...)"
std::string text_of(const PoseLattice& lattice);
/// "x 1.00 mm, y 2.00 mm, theta 0.500 rad"
std::string text_of(const Pose& pose);

}  // namespace palpate::python
