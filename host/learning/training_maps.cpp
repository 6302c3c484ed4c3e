#include "learning/training_maps.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "learning/observed_map.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// What `build` returns; its errors name whose map it would have been.
template <typename Build>
auto named(const std::string& name, const Build& build) {
  try {
    return build();
  } catch (const Error& error) {
    throw Error(error.fault(), fmt::format("{}: {}", name, error.what()));
  }
}

/// The presses of every object, with its label but no map, by label.
std::vector<TrainingMap> objects_of(const std::vector<Press>& presses) {
  std::map<std::string, std::vector<std::size_t>> of_label;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    of_label[presses[i].label].push_back(i);
  }
  std::vector<TrainingMap> objects;
  for (auto& [label, own] : of_label) {
    objects.push_back({{.label = label}, std::move(own)});
  }
  return objects;
}

}  // namespace

std::vector<TrainingMap> maps_of_presses(const std::vector<Press>& presses,
                                         const MapOptions& options) {
  std::vector<TrainingMap> maps(presses.size());
  tbb::parallel_for(std::size_t{0}, presses.size(), [&](std::size_t i) {
    const Press& press = presses[i];
    maps[i] = {named(press.name, [&] { return observed_map(press.touches, options, press.label); }),
               {i}};
  });
  return maps;
}

MapsByFolds maps_by_folds(const std::vector<Press>& presses, const MapOptions& options,
                          std::size_t folds) {
  const std::vector<std::size_t> fold = folds_of(presses, folds);
  MapsByFolds maps{.of_objects = objects_of(presses), .without_folds = {}};
  std::vector<std::vector<TrainingMap>> without(maps.of_objects.size());
  tbb::parallel_for(std::size_t{0}, maps.of_objects.size(), [&](std::size_t object) {
    TrainingMap& whole = maps.of_objects[object];
    std::vector<Touch> touches;
    std::vector<std::size_t> part;
    for (const std::size_t press : whole.presses) {
      touches.push_back(presses[press].touches.front());
      touches.back().T_robot_sensor =
          *presses[press].T_object_robot * touches.back().T_robot_sensor;
      part.push_back(fold[press]);
    }
    ObservedMaps built = named(
        whole.map.label, [&] { return observed_maps(touches, part, options, whole.map.label); });
    whole.map = std::move(built.all);
    for (std::size_t own = 0; own < built.without.size(); ++own) {
      if (std::ranges::find(part, own) != part.end() && !built.without[own].log_odds.empty()) {
        TrainingMap& map =
            without[object].emplace_back(TrainingMap{std::move(built.without[own]), whole.presses});
        std::erase_if(map.presses, [&](std::size_t press) { return fold[press] == own; });
      }
    }
  });
  for (std::vector<TrainingMap>& own : without) {
    std::ranges::move(own, std::back_inserter(maps.without_folds));
  }
  return maps;
}

}  // namespace palpate
