#pragma once

#include <optional>
#include <string>
#include <vector>

#include "palpate/scene.hpp"
#include "recognition_record.hpp"

namespace palpate::cli {

/// The flags that select touches of recordings, as given.
struct UnknownsFlags {
  std::vector<std::string> recordings;
  std::string frames;
  std::optional<int> touches;
  bool each_frame = false;
};

struct Unknowns {
  std::vector<Recording> recordings;
  std::vector<Unknown> list;  ///< views into the recordings' memory, which a move keeps
};

/// Reads the recordings and selects their touches; see replace_array(). Throws Error.
Unknowns read_unknowns(const UnknownsFlags& flags, const Scene& scene,
                       const std::string& scene_file);

}  // namespace palpate::cli
