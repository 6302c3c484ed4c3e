#pragma once

#include "types.hpp"

namespace palpate::python {

// The methods `plot` and `_repr_png_`, which palpate.plots implements in Python.

inline nb::object plot_method(nb::handle self, nb::handle ax) {
  return call("palpate.plots", "plot", self, ax);
}
inline nb::object png_method(nb::handle self) { return call("palpate.plots", "png", self); }
inline const nb::sig plot_signature(
    "def plot(self, ax: matplotlib.axes.Axes | None = None) -> matplotlib.axes.Axes");
inline const nb::sig png_signature("def _repr_png_(self) -> bytes | None");

}  // namespace palpate::python
