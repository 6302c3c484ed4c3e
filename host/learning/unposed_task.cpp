#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "learning/contact_learning.hpp"
#include "learning/map_task.hpp"
#include "learning/progress.hpp"
#include "learning/table_learning.hpp"
#include "learning/unposed_maps.hpp"
#include "palpate/error.hpp"
#include "recognition/request.hpp"

namespace palpate {

namespace {

UnposedOptions unposed_options(const MapTask& task, const std::optional<LearnedSensor>& sensor) {
  UnposedOptions result;
  result.map = task.options(sensor);
  std::vector<Touch> all;
  for (const ObjectTouches& object : task.objects) {
    all.insert(all.end(), object.touches.begin(), object.touches.end());
  }
  double pitch_mm = 0.0;
  try {
    pitch_mm = element_pitch_mm(all);
  } catch (const Error& error) {
    refuse(task.recordings.front().path, "{}", error.what());
  }
  if (!task.request.cell_mm) {
    result.map.cell_mm = 0.5 * pitch_mm;
  }
  if (!sensor && !task.request.spread_mm) {
    result.map.sensor.spread_mm = unposed_spread_mm(pitch_mm);
  }
  result.map.sensor.prior = task.prior(sensor).value_or(
      share_in_contact(evidence_of(all, {.classifier = result.map.classifier})));
  result.contact.classifier = result.map.classifier;
  result.contact.prior = result.map.sensor.prior;
  result.most_maps = task.most_maps();
  result.mirror = task.request.mirror;
  if (sensor) {
    result.contact.gamma = sensor->gamma;
    result.temperature = sensor->temperature;
  }
  return result;
}

std::string fit_words(const UnposedMap& map) {
  double least = 1.0;
  double sum = 0.0;
  for (const PlacedPress& press : map.presses) {
    if (!press.fit) {
      return "a press that fits no other";
    }
    least = std::min(least, *press.fit);
    sum += *press.fit;
  }
  return fmt::format("{} presses that fit by {:.2f} on average, {:.2f} at least",
                     map.presses.size(), sum / static_cast<double>(map.presses.size()), least);
}

/// Says which older maps of the label `recognize` would read besides the new ones.
void warn_of_older_maps(const MapRequest& request, const std::string& label, std::size_t count,
                        std::vector<std::string>& remarks) {
  constexpr std::size_t most_looked_for = 99;
  for (std::size_t map = 0; map <= most_looked_for; ++map) {  // 0: the only one of its label
    const bool is_new = count == 1 ? map == 0 : map > 0 && map <= count;
    const std::filesystem::path file =
        request.map_file(map == 0 ? label : name_of(label, map - 1, count + 1));
    if (std::error_code ignored; !is_new && std::filesystem::exists(file, ignored)) {
      remarks.push_back(
          fmt::format("{}: an older map of '{}'; remove it, or `maps {}` reads it, too",
                      file.string(), label, request.output));
    }
  }
}

/// Adds the maps of an object, and what is to be said of them.
void add_object(const MapTask& task, std::size_t object, UnposedMaps made, LearnedMaps& learned) {
  const MapRequest& request = task.request;
  const std::string& label = task.objects[object].label;
  const std::vector<TouchSource>& sources = task.sources[object];
  const std::size_t count = made.maps.size();
  for (std::size_t m = 0; m < count; ++m) {
    UnposedMap& one = made.maps[m];
    const std::string name = name_of(label, m, count);
    const std::string file = request.map_file(name).string();
    learned.words.push_back(fmt::format("{}: {} from {}; {} x {} cells of {:.4g} mm, prior {:.3g}",
                                        file, label, fit_words(one), one.map.nx, one.map.ny,
                                        one.map.cell_mm, one.map.prior));
    for (const PlacedPress& press : one.presses) {
      if (press.fit && *press.fit < doubtful_fit) {
        learned.words.push_back(fmt::format("{}: press {} fits {} by only {:.2f}",
                                            sources[press.press].path, sources[press.press].index,
                                            file, *press.fit));
      }
    }
    settle_symmetry(request, one.map);
    learned.maps.push_back({name, std::move(one.map)});
  }
  for (const Misfit& misfit : made.misfits) {
    const TouchSource& source = sources[misfit.press];
    learned.words.push_back(
        fmt::format("{}: press {} left out: {}", source.path, source.index, misfit.reason));
  }
  if (!made.settled) {
    learned.words.push_back(fmt::format("{}: presses still moved after {} rounds; look at the maps",
                                        label, made.rounds));
  }
  if (request.to_folder() && !request.output.empty()) {
    warn_of_older_maps(request, label, count, learned.remarks);
  }
}

}  // namespace

std::string name_of(const std::string& label, std::size_t map, std::size_t count) {
  return count == 1 ? label : fmt::format("{}.{}", label, map + 1);
}

std::size_t MapTask::most_maps() const {
  // Into a folder, the maps that four times the cost in recognition buys.
  return static_cast<std::size_t>(request.max_maps.value_or(request.to_folder() ? 4 : 1));
}

std::vector<std::string> MapTask::names() const {
  std::vector<std::string> result;
  for (const ObjectTouches& object : objects) {
    result.push_back(object.label);
    for (std::size_t map = 0; request.unposed && request.to_folder() && map < most_maps(); ++map) {
      result.push_back(name_of(object.label, map, most_maps() + 1));
    }
  }
  return result;
}

LearnedMaps learn_unposed_maps(const MapTask& task, const std::function<void(double)>& progress) {
  constexpr double sensor_cost = 2.0;
  const auto count = static_cast<double>(task.objects.size());
  Progress work(count * (1.0 + (task.learns_sensor ? sensor_cost : 0.0)), progress);
  LearnedMaps learned{.replaces_sensor = task.learns_sensor};
  if (task.learns_sensor) {
    learn_unposed_sensor(task, learned, work.part(count * sensor_cost));
  }
  std::vector<std::string> of_sensor = std::exchange(learned.words, {});
  if (task.learns_sensor && !learned.sensor && !task.request.shared.threshold &&
      task.recordings.front().pressure_unit == "raw") {
    refuse(task.recordings.front().path, "{}; give `threshold`, which raw pressure then needs",
           of_sensor.front());
  }
  const std::optional<LearnedSensor>& sensor = task.learns_sensor ? learned.sensor : task.sensor;
  UnposedOptions options = unposed_options(task, sensor);
  for (std::size_t i = 0; i < task.objects.size(); ++i) {
    const auto& [label, touches] = task.objects[i];
    if (sensor && sensor->table) {
      options.contact.table = table_for(*sensor->table, label);
      options.layer = sensor->table->layer;
    }
    add_object(task, i, unposed_maps(touches, label, options, work.part(1.0)), learned);
  }
  for (const auto& [name, map] : learned.maps) {
    if (learned.sensor) {
      learned.sensor->maps[task.request.map_file(name).filename().string()] = digest_of(map);
    }
  }
  std::ranges::move(of_sensor, std::back_inserter(learned.words));
  return learned;
}

}  // namespace palpate
