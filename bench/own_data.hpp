#pragma once

#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "palpate/device.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate::bench {

/// A user's own maps and recordings.
struct OwnData {
  /// By the histogram; its lattice is that of `--bins fine`.
  RecognitionTask task;
  PoseLattice automatic;  ///< of `--bins auto`
  std::vector<std::shared_ptr<const Recording>> recordings;
  std::vector<Unknown> unknowns;  ///< views into the recordings
};

/// Reads maps and recordings, and finds region and bins as `palpate recognize` does.
/// @throws Error where one cannot be read, or the options do not suit `palpate recognize`
OwnData read_own_data(const OwnDataOptions& options);

/// The flags of `palpate recognize` that give the lattice, such as "--bins 14x14x53
/// --x-mm=-20:20 --y-mm=-20:20 --pivot-mm auto".
std::string flags_of(const PoseLattice& lattice, bool auto_pivot);

}  // namespace palpate::bench
