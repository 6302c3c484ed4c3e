#pragma once

#include "recognition/request.hpp"
#include "types.hpp"

namespace palpate::python {

/// Adds files, folders, and maps in memory, beside which files are read here.
void add_maps(const nb::list& items, Request& request);

}  // namespace palpate::python
