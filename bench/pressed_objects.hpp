#pragma once

#include <filesystem>
#include <vector>

#include "letters.hpp"
#include "palpate/contact_model.hpp"

namespace palpate::bench {

/// Everyday objects, each pressed several times by one large array.
struct PressedObjects {
  std::vector<Recording> recordings;  ///< [object], by file name
  std::vector<Hypothesis> maps;       ///< [object], each of the recording's first frame
  ContactModel contact;
  double pitch_mm = 0.0;  ///< of the array
};

/// Reads all recordings of a folder and builds the maps: raw pressure with a threshold of 15 and a
/// ratio of 0.15, a prior of 0.1, gamma of 0.2, a spread of 0.6 times the pitch and cells of half a
/// pitch.
/// @throws Error where the folder holds no recording, or one of another array than the first
PressedObjects read_presses(Device& device, const std::filesystem::path& folder);

}  // namespace palpate::bench
