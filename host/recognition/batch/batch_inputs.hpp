#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "recognition/request.hpp"

namespace palpate {

/// A recording of a batch, as its manifest or the caller names it.
struct BatchInput {
  std::string path;
  std::optional<Frames> frames;  ///< of the manifest; none: as the request says
  std::string label;             ///< of the manifest: the true label; "": the recording's own

  friend bool operator==(const BatchInput&, const BatchInput&) = default;
};

/// The recordings that the arguments stand for, in order: of a *.csv, those of its rows, whose
/// paths are relative to it; of a folder, its *.h5 by name, but for *.map.h5; of a pattern such as
/// 'touches/*.h5', those that match; of anything else, itself.
/// @throws Error (Fault::input) where a manifest or a folder cannot be read, where a manifest has
/// a column of another name than path, frames and label, and where there is no recording at all
std::vector<BatchInput> list_inputs(std::span<const std::string> arguments);

}  // namespace palpate
