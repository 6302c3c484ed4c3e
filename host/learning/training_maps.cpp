#include "learning/training_maps.hpp"

#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "learning/observed_map.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// observed_map(), whose errors name whose map it would have been.
OccupancyGrid named_map(std::span<const Touch> touches, const MapOptions& options,
                        const std::string& label, const std::string& name) {
  try {
    return observed_map(touches, options, label);
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

/// Builds each map of its presses, which are at known poses.
void build(std::vector<TrainingMap>& maps, const std::vector<Press>& presses,
           const MapOptions& options) {
  tbb::parallel_for(std::size_t{0}, maps.size(), [&](std::size_t i) {
    std::vector<Touch> touches;
    for (const std::size_t press : maps[i].presses) {
      touches.push_back(presses[press].touches.front());
      touches.back().T_robot_sensor =
          *presses[press].T_object_robot * touches.back().T_robot_sensor;
    }
    const std::string label = maps[i].map.label;
    maps[i].map = named_map(touches, options, label, label);
  });
}

}  // namespace

std::vector<TrainingMap> maps_of_presses(const std::vector<Press>& presses,
                                         const MapOptions& options) {
  std::vector<TrainingMap> maps(presses.size());
  tbb::parallel_for(std::size_t{0}, presses.size(), [&](std::size_t i) {
    const Press& press = presses[i];
    maps[i] = {named_map(press.touches, options, press.label, press.name), {i}};
  });
  return maps;
}

std::vector<TrainingMap> maps_without_folds(const std::vector<Press>& presses,
                                            const MapOptions& options, std::size_t folds) {
  const std::vector<std::size_t> fold = folds_of(presses, folds);
  std::vector<TrainingMap> maps;
  for (const TrainingMap& all : objects_of(presses)) {
    std::set<std::size_t> own;
    for (const std::size_t press : all.presses) {
      own.insert(fold[press]);
    }
    for (const std::size_t without : own) {
      TrainingMap map = all;
      std::erase_if(map.presses, [&](std::size_t press) { return fold[press] == without; });
      if (!map.presses.empty()) {
        maps.push_back(std::move(map));
      }
    }
  }
  build(maps, presses, options);
  return maps;
}

std::vector<TrainingMap> maps_of_objects(const std::vector<Press>& presses,
                                         const MapOptions& options) {
  std::vector<TrainingMap> maps = objects_of(presses);
  build(maps, presses, options);
  return maps;
}

}  // namespace palpate
