#include "learning/map_task.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "estimation/maps/left_out_fit.hpp"
#include "io/input_file.hpp"
#include "learning/observed_map.hpp"
#include "learning/press.hpp"
#include "learning/progress.hpp"
#include "learning/setup_check.hpp"
#include "learning/touch_alignment.hpp"
#include "model/angle_unit.hpp"
#include "model/element_spacing.hpp"
#include "options/option.hpp"
#include "palpate/error.hpp"
#include "recognition/recordings.hpp"

namespace palpate {

namespace {

/// Gathers the touches of all recordings by label, in the labels' order.
void group_by_label(MapTask& task, const ContactClassifier& classifier) {
  const MapRequest& request = task.request;
  const Pose T_object_robot = inverse(given_origin(request).value_or(Pose{}));
  std::map<std::string, std::pair<std::vector<Touch>, std::vector<TouchSource>>> groups;
  for (const Recording& recording : task.recordings) {
    const auto [object, own_group] = grouped_object(recording, request.group);
    const std::string& label = request.label.empty() ? object : request.label;
    require_name(recording.path, label);
    const auto [begin, end] = selected_touches(recording, request.shared.frames);
    auto& [touches, sources] = groups[label];
    for (std::size_t i = begin; i < end; ++i) {
      Touch touch = recording.touch(i);
      touch.T_robot_sensor = request.unposed ? Pose{} : T_object_robot * touch.T_robot_sensor;
      if (const auto fault = fault_of(known_readings(touch, classifier))) {
        refuse(recording.path, "sensor_pose[{}]: {}", i, *fault);
      }
      touches.push_back(touch);
      sources.push_back({recording.path, i, own_group});
    }
    if (!request.to_folder() && groups.size() > 1) {
      const Recording& first = task.recordings.front();
      refuse(
          recording.path,
          "object '{}' differs from '{}' of {}; write a map of each object with `output {}/`, or "
          "one map of all touches with `label`",
          label, first.object, first.path, request.output);
    }
  }
  for (auto& [label, group] : groups) {
    task.objects.push_back({label, std::move(group.first)});
    task.sources.push_back(std::move(group.second));
  }
}

/// Throws Error where the groups of an object's touches leave none to learn from without one.
void require_two_groups(const MapTask& task) {
  for (std::size_t i = 0; i < task.objects.size() && !task.request.group.empty(); ++i) {
    const std::vector<TouchSource>& sources = task.sources[i];
    if (!sources.empty() && std::ranges::all_of(sources, [&](const TouchSource& source) {
          return source.group == sources.front().group;
        })) {
      refuse_option("group", task.request.group,
                    "all touches of '{}' are of '{}': none are left to learn from without them; "
                    "give touches of two groups or more of each object",
                    task.objects[i].label, sources.front().group);
    }
  }
}

/// Refuses touches in which every element is in contact in all of many touches: a map of them has
/// no outline, and its cells' number makes every later step long.
void require_outline(const MapTask& task, const ContactClassifier& classifier) {
  constexpr std::size_t few = 10;
  for (const ObjectTouches& object : task.objects) {
    double least = std::numeric_limits<double>::infinity();
    const bool all = std::ranges::all_of(object.touches, [&](const Touch& touch) {
      const std::vector<Reading> readings = classifier.classify(touch);
      for (std::size_t k = 0; k < readings.size(); ++k) {
        least = readings[k] == Reading::in_contact ? std::min(least, touch.pressure[k]) : least;
      }
      return std::ranges::none_of(readings, [](Reading r) { return r == Reading::no_contact; });
    });
    if (all && object.touches.size() >= few && std::isfinite(least)) {
      refuse(fmt::format("object '{}'", object.label),
             "every element is in contact in all {} touches, which read {:.3g} {} or more, so that "
             "its map would have no outline; subtract what the untouched array reads, or give a "
             "higher `threshold`",
             object.touches.size(), least, task.recordings.front().pressure_unit);
    }
  }
}

/// Sentences about what seems wrong with recordings of touches at known poses.
void add_remarks(MapTask& task) {
  for (const Recording& recording : task.recordings) {
    if (recording.size() > 1 && !has_poses(recording)) {
      // Touches that are no touches of one place would make a blur.
      task.remarks.push_back(
          fmt::format("{}: all {} touches are at one pose; if their poses are unknown, give "
                      "`unposed`",
                      recording.path, recording.size()));
    }
    for (const SetupFinding& finding : recording.findings) {
      task.remarks.push_back(fmt::format("{}: {}", recording.path, finding.words));
    }
  }
}

/// The sensor model that the request names.
std::optional<LearnedSensor> sensor_of(const MapRequest& request, const Recording& first) {
  const std::string& file = request.shared.sensor_model;
  if (file.empty() || file == no_sensor_model) {
    return {};
  }
  LearnedSensor sensor = read_sensor_model(file);
  if (sensor.pressure_unit != first.pressure_unit) {
    refuse(file,
           "pressure_unit is {} but {} has {}; give a sensor model that was learned from such "
           "recordings",
           sensor.pressure_unit, first.path, first.pressure_unit);
  }
  return sensor;
}

/// Aligns the touches by touch_sd, and says how far they moved.
void align(std::vector<ObjectTouches>& objects, const DisplacementSd& sd, const MapOptions& options,
           LearnedMaps& learned, const std::function<void(double)>& progress) {
  const TouchAlignment found = align_touches(objects, sd, options, progress);
  learned.words.push_back(
      fmt::format("touches moved by {:.2f} mm along x and y and by {:.2f} degrees, root mean "
                  "square, to the map "
                  "of the others in {} rounds",
                  found.moved.mm, degrees(found.moved.rad), found.rounds));
  const auto compare = [&](const char* option, const char* unit, double given, double told) {
    constexpr double least = 0.75;
    constexpr double limit = 1.1;  // the posterior keeps what it finds near a given that is too low
    if (given > 0.0 && !(told > least * given && told < limit * given)) {
      learned.remarks.push_back(
          fmt::format("by the touches the sensor was {:.2g} {} off where `{}` says {:g}: give {}",
                      told, unit, option, given, told < given ? "less" : "more"));
    }
  };
  compare("touch-sd-mm", "mm", sd.mm, found.displaced.mm);
  compare("touch-sd-deg", "degrees", degrees(sd.rad), degrees(found.displaced.rad));
}

/// The map of an object at known poses, with its source.
/// @param builder with these options
OccupancyGrid posed_map(const MapTask& task, std::size_t object, const ObjectTouches& touches,
                        const MapOptions& options, MapBuilder& builder, Device& device) {
  OccupancyGrid map;
  // What was learned is compared with more than log odds.
  if (task.sensor) {
    map = observed_map(touches.touches, options, touches.label);
  } else {
    builder.clear();
    builder.add(touches.touches);
    map = builder.build(touches.label);
  }
  if (task.learns_sensor) {
    OccupancyGrid observed = observed_map(touches.touches, options, touches.label);
    map.observations = std::move(observed.observations);
    map.mean_level = std::move(observed.mean_level);
  }
  map.mirror = task.request.mirror;
  MapSource source{gathered(touches, task.recordings.front().pressure_unit), options};
  if (!task.request.group.empty()) {
    std::ranges::transform(task.sources[object], std::back_inserter(source.groups),
                           &TouchSource::group);
  }
  judge_left_out(device, source);
  map.source = std::make_shared<const MapSource>(std::move(source));
  settle_frame(task.request, map);
  return map;
}

LearnedMaps learn_posed_maps(const MapTask& task, Device& device,
                             const std::function<void(double)>& progress) {
  LearnedMaps learned{.replaces_sensor = task.learns_sensor};
  MapOptions options = task.options(task.sensor);
  if (const auto finding = suspected_order(device, task.recordings, options)) {
    learned.remarks.push_back(
        fmt::format("{} ({:.0f} nats; palpate check tells more)", finding->words, finding->nats));
  }
  constexpr double align_cost = 4.0;  // of building the maps
  constexpr double sensor_cost = 7.0;
  const auto count = static_cast<double>(task.objects.size());
  const DisplacementSd sd = task.request.touch_sd();
  Progress work(
      count * (1.0 + (sd.none() ? 0.0 : align_cost) + (task.learns_sensor ? sensor_cost : 0.0)),
      progress);
  std::vector<ObjectTouches> objects = task.objects;
  if (!sd.none()) {
    align(objects, sd, options, learned, work.part(count * align_cost));
  }
  const std::optional<double> prior = task.prior(task.sensor);
  options.sensor.prior = prior ? *prior : estimate_prior(device, objects, options);
  MapBuilder builder(device, options);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    OccupancyGrid map = posed_map(task, i, objects[i], options, builder, device);
    const std::optional<RotationalSymmetry> symmetry = settle_symmetry(task.request, map);
    learned.add(task.request, std::move(map), fmt::format("{} touches", objects[i].touches.size()),
                symmetry);
    work.part(1.0)(1.0);
  }
  if (task.learns_sensor) {
    learn_sensor(task, options, learned, work.part(count * sensor_cost));
  }
  return learned;
}

}  // namespace

MapOptions MapTask::options(const std::optional<LearnedSensor>& by) const {
  MapOptions result;
  result.cell_mm = request.cell_mm.value_or(result.cell_mm);
  result.sensor.spread_mm =
      request.spread_mm.value_or(by ? by->spread_mm : usual_spread_mm(recordings));
  result.sensor.peak = request.peak.value_or(result.sensor.peak);
  std::optional<double> threshold = request.shared.threshold;
  std::optional<double> ratio = request.shared.ratio;
  if (by) {
    threshold = threshold.value_or(by->classifier.threshold);
    ratio = ratio.value_or(by->classifier.ratio);
  }
  const Recording& first = recordings.front();
  result.classifier = make_classifier(first.pressure_unit, first.path, threshold, ratio);
  return result;
}

std::optional<double> MapTask::prior(const std::optional<LearnedSensor>& by) const {
  return by && request.prior.empty() ? std::optional(by->prior) : given_prior(request);
}

MapTask map_task(const MapRequest& request, std::span<const Recording> recordings) {
  request.validate();
  MapTask task{.request = request, .recordings = recordings};
  task.sensor = sensor_of(request, recordings.front());
  task.learns_sensor = learns_sensor(request, task.remarks);
  // The sensor that unknown poses learn brings a threshold.
  const LearnedSensor any{.pressure_unit = recordings.front().pressure_unit};
  const ContactClassifier classifier =
      task.options(request.unposed && task.learns_sensor ? any : task.sensor).classifier;
  group_by_label(task, classifier);
  require_two_groups(task);
  std::vector<std::string> labels;
  std::ranges::transform(task.objects, std::back_inserter(labels), &ObjectTouches::label);
  require_known_symmetries(request, labels);
  if (!request.unposed) {
    require_outline(task, classifier);
    add_remarks(task);
  }
  return task;
}

LearnedMaps learn_maps(const MapTask& task, const std::function<Device&()>& device,
                       const std::function<void(double)>& progress) {
  return task.request.unposed ? learn_unposed_maps(task, progress)
                              : learn_posed_maps(task, device(), progress);
}

}  // namespace palpate
