#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "palpate/scene.hpp"
#include "palpate/touch.hpp"

namespace palpate::cli {

/// The flags that select touches of recordings, as given.
struct UnknownsFlags {
  std::vector<std::string> recordings;
  std::string frames;
  std::optional<int> touches;
  bool each_frame = false;
};

/// One unknown object: some touches of one recording, in order.
struct Unknown {
  const Recording* recording = nullptr;
  std::optional<std::size_t> frame;  ///< index in the file, with --each-frame
  std::vector<Touch> touches;
};

struct Unknowns {
  std::vector<Recording> recordings;
  std::vector<Unknown> list;  ///< views into `recordings`; moving them along is safe
  bool still_array = false;   ///< all are presses of one large array that stays where it is
};

/// Reads the recordings, with the scene's array in the place of their own where it has one.
/// Throws Error.
Unknowns read_unknowns(const UnknownsFlags& flags, const Scene& scene,
                       const std::string& scene_file);

}  // namespace palpate::cli
