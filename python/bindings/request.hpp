#pragma once

#include "cli/recognition_flags.hpp"
#include "cli/unknowns.hpp"
#include "types.hpp"

namespace palpate::python {

/// The flags of a recognition, as a call from Python gives them.
struct Request {
  cli::RecognitionFlags flags;
  cli::UnknownFlags unknowns;
  bool trace = false;
};

/// Files and folders of maps become flags; beside maps in memory they are read here.
void add_maps(const nb::list& items, cli::RecognitionFlags& flags);

}  // namespace palpate::python
