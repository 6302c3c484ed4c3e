#include "learning/press.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "learning/observed_map.hpp"
#include "model/refuse.hpp"

namespace palpate {

namespace {

/// The folds of presses of two groups or more; empty where there are fewer.
std::vector<std::size_t> folds_of_groups(const std::vector<Press>& presses, std::size_t folds) {
  std::map<std::string, std::size_t> fold_of;                // [group]
  std::map<std::string, std::vector<std::size_t>> of_label;  // presses in each fold
  std::vector<std::size_t> in_fold(folds);
  std::vector<std::size_t> fold;
  for (const Press& press : presses) {
    std::vector<std::size_t>& own = of_label[press.label];
    own.resize(folds);
    const auto [group, is_new] = fold_of.try_emplace(press.group, std::size_t{0});
    for (std::size_t k = 0; is_new && k < folds; ++k) {
      const std::size_t best = group->second;
      if (std::tie(own[k], in_fold[k]) < std::tie(own[best], in_fold[best])) {
        group->second = k;
      }
    }
    fold.push_back(group->second);
    ++own[fold.back()];
    ++in_fold[fold.back()];
  }
  return fold_of.size() < 2 ? std::vector<std::size_t>{} : fold;
}

/// What `build` returns; its errors name whose map it would have been.
template <typename Build>
auto named(const std::string& name, const Build& build) {
  try {
    return build();
  } catch (const Error& error) {
    throw Error(error.fault(), fmt::format("{}: {}", name, error.what()));
  }
}

}  // namespace

GroupedObject grouped_object(const Recording& recording, const std::string& by) {
  if (by.empty()) {
    return {recording.object, ""};
  }
  if (by == "recording") {
    return {recording.object, recording.path};
  }
  if (by != "label") {
    throw Error(Fault::input, fmt::format("`group {}`: give recording or label", by));
  }
  const std::size_t at = recording.object.rfind('@');
  if (at == std::string::npos || at == 0 || at + 1 == recording.object.size()) {
    refuse(recording.path,
           "object '{}' names no group; name it as LABEL@GROUP, or give `group recording`",
           recording.object);
  }
  return {recording.object.substr(0, at), recording.object.substr(at + 1)};
}

bool has_poses(const Recording& recording) {
  return std::ranges::any_of(recording.T_robot_sensor, [&](const Pose& pose) {
    const Pose& first = recording.T_robot_sensor.front();
    return pose.translation_mm != first.translation_mm || pose.theta_rad != first.theta_rad;
  });
}

Recording gathered(const ObjectTouches& object, const std::string& pressure_unit) {
  Recording result{.object = object.label, .pressure_unit = pressure_unit};
  std::size_t largest = 0;
  bool one_array = true;
  bool dead = false;
  for (const Touch& touch : object.touches) {
    largest = std::max(largest, touch.pressure.size());
    one_array =
        one_array && std::ranges::equal(touch.elements_mm, object.touches.front().elements_mm);
    dead = dead || !touch.valid.empty();
  }
  for (const Touch& touch : object.touches) {
    const std::size_t lacks = largest - touch.pressure.size();
    result.T_robot_sensor.push_back(touch.T_robot_sensor);
    result.pressure.insert(result.pressure.end(), touch.pressure.begin(), touch.pressure.end());
    result.pressure.insert(result.pressure.end(), lacks, 0.0);
    if (!one_array || result.elements_mm.empty()) {
      result.elements_mm.insert(result.elements_mm.end(), touch.elements_mm.begin(),
                                touch.elements_mm.end());
      result.elements_mm.insert(result.elements_mm.end(), lacks, touch.elements_mm.front());
    }
    if (dead || !one_array) {
      const std::vector<std::uint8_t> all_alive(touch.pressure.size(), 1);
      const std::span<const std::uint8_t> valid = touch.valid.empty() ? all_alive : touch.valid;
      result.valid.insert(result.valid.end(), valid.begin(), valid.end());
      result.valid.insert(result.valid.end(), lacks, 0);
    }
  }
  return result;
}

Press single_press(const Recording& recording, std::size_t touch) {
  Press press{fmt::format("{}, touch {}", recording.path, touch), recording.object, {}};
  press.touches.push_back(recording.touch(touch));
  press.touches.front().T_robot_sensor = {-array_centre_mm(press.touches.front().elements_mm), 0.0};
  return press;
}

Press posed_press(const Recording& recording, std::size_t touch) {
  Press press = single_press(recording, touch);
  press.T_object_robot =
      recording.touch(touch).T_robot_sensor * inverse(press.touches.front().T_robot_sensor);
  return press;
}

std::vector<std::size_t> folds_of(const std::vector<Press>& presses, std::size_t folds) {
  if (std::vector<std::size_t> of_groups = folds_of_groups(presses, folds); !of_groups.empty()) {
    return of_groups;
  }
  std::map<std::string, std::size_t> of_label;
  for (const Press& press : presses) {
    ++of_label[press.label];
  }
  std::map<std::string, std::size_t> counted;
  std::vector<std::size_t> fold;
  for (const Press& press : presses) {
    const std::size_t k = counted[press.label]++;
    fold.push_back(press.T_object_robot ? k % folds : k * folds / of_label.at(press.label));
  }
  return fold;
}

std::vector<Press> presses_without(std::size_t fold, const std::vector<Press>& presses,
                                   std::size_t folds) {
  const std::vector<std::size_t> fold_of = folds_of(presses, folds);
  std::vector<Press> others;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (fold_of[i] != fold) {
      others.push_back(presses[i]);
    }
  }
  return others;
}

bool at_known_poses(const std::vector<Press>& presses) {
  return std::ranges::all_of(presses,
                             [](const Press& press) { return press.T_object_robot.has_value(); });
}

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
  std::map<std::string, std::vector<std::size_t>> of_label;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    of_label[presses[i].label].push_back(i);
  }
  MapsByFolds maps;
  for (auto& [label, own] : of_label) {
    maps.of_objects.push_back({{.label = label}, std::move(own)});
  }
  std::vector<std::vector<TrainingMap>> without(maps.of_objects.size());
  tbb::parallel_for(std::size_t{0}, maps.of_objects.size(), [&](std::size_t object) {
    OccupancyGrid& map = maps.of_objects[object].map;
    const std::vector<std::size_t>& own = maps.of_objects[object].presses;
    std::vector<Touch> touches;
    std::vector<std::size_t> part;
    for (const std::size_t press : own) {
      touches.push_back(presses[press].touches.front());
      touches.back().T_robot_sensor =
          *presses[press].T_object_robot * touches.back().T_robot_sensor;
      part.push_back(fold[press]);
    }
    ObservedMaps built =
        named(map.label, [&] { return observed_maps(touches, part, options, map.label); });
    map = std::move(built.all);
    for (const std::size_t k : std::set(part.begin(), part.end())) {
      if (!built.without[k].log_odds.empty()) {
        TrainingMap& others =
            without[object].emplace_back(TrainingMap{std::move(built.without[k]), own});
        std::erase_if(others.presses, [&](std::size_t press) { return fold[press] == k; });
      }
    }
  });
  for (std::vector<TrainingMap>& own : without) {
    std::ranges::move(own, std::back_inserter(maps.without_folds));
  }
  return maps;
}

}  // namespace palpate
