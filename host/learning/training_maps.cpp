#include "training_maps.hpp"

#include <map>
#include <set>
#include <span>
#include <string>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "observed_map.hpp"
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
  std::map<std::string, std::vector<std::size_t>> of_label;
  std::map<std::string, std::set<std::size_t>> folds_of_label;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    of_label[presses[i].label].push_back(i);
    folds_of_label[presses[i].label].insert(fold[i]);
  }
  std::vector<TrainingMap> maps;
  for (const auto& [label, own] : of_label) {
    for (const std::size_t without : folds_of_label.at(label)) {
      TrainingMap map;
      map.map.label = label;
      std::ranges::copy_if(own, std::back_inserter(map.presses),
                           [&](std::size_t press) { return fold[press] != without; });
      if (!map.presses.empty()) {
        maps.push_back(std::move(map));
      }
    }
  }
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
  return maps;
}

}  // namespace palpate
