#include "pressed_objects.hpp"

#include <algorithm>
#include <limits>
#include <system_error>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate::bench {

namespace {

constexpr ContactClassifier classifier{.threshold = 15.0, .ratio = 0.15};
constexpr double prior = 0.1;
constexpr double gamma = 0.2;
constexpr double spread_pitches = 0.6;
constexpr double cell_pitches = 0.5;

/// The distance of the first element from its nearest neighbour.
double pitch_of(const Recording& recording) {
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (std::size_t e = 1; e < recording.elements(); ++e) {
    nearest_mm =
        std::min(nearest_mm, glm::distance(recording.elements_mm[0], recording.elements_mm[e]));
  }
  return nearest_mm;
}

std::vector<std::filesystem::path> recordings_in(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".h5") {
      paths.push_back(entry.path());
    }
  }
  if (error || paths.empty()) {
    throw Error(Fault::input,
                fmt::format("--presses {}: {}; give a folder of recordings (*.h5)", folder.string(),
                            error ? error.message() : "holds no recording"));
  }
  std::ranges::sort(paths);
  return paths;
}

}  // namespace

PressedObjects read_presses(Device& device, const std::filesystem::path& folder) {
  PressedObjects objects;
  for (const std::filesystem::path& path : recordings_in(folder)) {
    objects.recordings.push_back(read_recording(path));
    const Recording& recording = objects.recordings.back();
    if (recording.elements() < 2 ||
        recording.elements_mm != objects.recordings.front().elements_mm) {
      throw Error(Fault::input, fmt::format("{}: elements: not the array of {}; give a folder of "
                                            "recordings by one array",
                                            path.string(), objects.recordings.front().path));
    }
  }
  objects.pitch_mm = pitch_of(objects.recordings.front());
  objects.contact = {.classifier = classifier, .gamma = gamma, .prior = prior};
  MapBuilder builder(device,
                     {.cell_mm = cell_pitches * objects.pitch_mm,
                      .sensor = {.spread_mm = spread_pitches * objects.pitch_mm, .prior = prior},
                      .classifier = classifier});
  for (const Recording& recording : objects.recordings) {
    builder.clear();
    builder.add(recording.touches(0, 1));
    objects.maps.push_back({.map = builder.build(recording.object)});
  }
  return objects;
}

}  // namespace palpate::bench
