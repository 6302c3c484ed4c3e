#include "cli/commands.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/map_drawing.hpp"
#include "cli/map_flags.hpp"
#include "cli/map_output.hpp"
#include "cli/map_sensor.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "estimation/maps/left_out_fit.hpp"
#include "learning/observed_map.hpp"
#include "learning/press.hpp"
#include "learning/setup_check.hpp"
#include "learning/touch_alignment.hpp"
#include "model/option_words.hpp"
#include "palpate/error.hpp"
#include "palpate/map_builder.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

void add_in_batches(MapBuilder& builder, std::span<const Touch> touches,
                    const std::function<void(double)>& progress) {
  constexpr std::size_t batch = 1000;
  for (std::size_t begin = 0; begin < touches.size(); begin += batch) {
    builder.add(touches.subspan(begin, std::min(batch, touches.size() - begin)));
    progress(static_cast<double>(begin) / static_cast<double>(touches.size()));
  }
}

/// The touches as one recording. Where their arrays differ, it has elements for the largest, and
/// those that a touch lacks are dead.
Recording gathered(const ObjectTouches& object, const std::string& pressure_unit) {
  Recording result{.object = object.label, .pressure_unit = pressure_unit};
  std::size_t most = 0;
  bool one_array = true;
  bool dead = false;
  for (const Touch& touch : object.touches) {
    most = std::max(most, touch.pressure.size());
    one_array =
        one_array && std::ranges::equal(touch.elements_mm, object.touches.front().elements_mm);
    dead = dead || !touch.valid.empty();
  }
  for (const Touch& touch : object.touches) {
    const std::size_t lacks = most - touch.pressure.size();
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

OccupancyGrid build_map(MapBuilder& builder, const ObjectTouches& object,
                        const std::function<void(double)>& progress) {
  builder.clear();
  add_in_batches(builder, object.touches, progress);
  return builder.build(object.label);
}

/// Aligns the touches by --touch-sd-mm and --touch-sd-deg, and says how far they moved.
void align(const MapFlags& flags, const MapOptions& model, std::vector<ObjectTouches>& objects) {
  const DisplacementSd sd = touch_sd(flags);
  if (sd.none()) {
    return;
  }
  TouchAlignment found;
  {
    Progress progress("aligning touches");
    found = align_touches(objects, sd, model, [&](double done) { progress.show(done); });
  }
  fmt::print(
      "touches moved by {:.2f} mm along x and y and by {:.2f} degrees, root mean square, to "
      "the map of the others in {} rounds\n",
      found.moved.mm, degrees(found.moved.rad), found.rounds);
  const auto compare = [](const char* flag, const char* unit, double given, double told) {
    constexpr double least = 0.75;
    constexpr double most = 1.1;  // the posterior keeps what it finds near a given that is too low
    if (given > 0.0 && !(told > least * given && told < most * given)) {
      fmt::print(
          stderr,
          "palpate: by the touches the sensor was {:.2g} {} off where {} says {:g}: give {}\n",
          told, unit, flag, given, told < given ? "less" : "more");
    }
  };
  compare("--touch-sd-mm", "mm", sd.mm, found.displaced.mm);
  compare("--touch-sd-deg", "degrees", degrees(sd.rad), degrees(found.displaced.rad));
}

/// Says where poses are unknown: touches that are no touches of one place would make a blur.
void warn_of_unknown_poses(const std::vector<Recording>& recordings) {
  for (const Recording& recording : recordings) {
    if (recording.size() > 1 && !has_poses(recording)) {
      fmt::print(stderr,
                 "palpate: {}: all {} touches are at one pose; if their poses are unknown, give "
                 "--unposed\n",
                 recording.path, recording.size());
    }
  }
}

/// Refuses touches in which every element is in contact in all of many touches: a map of them has
/// no outline, and its cells' number makes every later step long.
void require_outline(std::span<const ObjectTouches> objects, const ContactClassifier& classifier,
                     const std::string& pressure_unit) {
  constexpr std::size_t few = 10;
  for (const ObjectTouches& object : objects) {
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
             "higher --threshold",
             object.touches.size(), least, pressure_unit);
    }
  }
}

void build_maps(const MapFlags& flags) {
  const std::vector<Recording> recordings = read_touch_recordings(flags.recordings);
  const std::optional<LearnedSensor> sensor = sensor_of(flags, recordings);
  MapOptions model = map_options(flags, recordings, sensor);
  const std::optional<double> prior = given_prior(flags, sensor);
  const ObjectOrigin origin = object_origin(flags);
  const GroupedTouches grouped = group_by_label(flags, recordings, model.classifier);
  std::vector<ObjectTouches> objects = grouped.objects;

  require_outline(objects, model.classifier, recordings.front().pressure_unit);

  std::vector<std::filesystem::path> map_paths;
  std::vector<std::string> names;
  for (const ObjectTouches& object : objects) {
    names.push_back(object.label);
    map_paths.push_back(map_path(flags, object.label));
  }
  const bool learns = learns_sensor(flags);
  std::vector<std::filesystem::path> outputs = map_paths;
  if (learns) {
    outputs.push_back(sensor_file(flags));
  }
  prepare_outputs(flags, outputs, names);
  warn_of_unknown_poses(recordings);
  for (const Recording& recording : recordings) {
    for (const SetupFinding& finding : recording.findings) {
      tell_on_stderr(fmt::format("{}: {}", recording.path, finding.words));
    }
  }

  Device device = Device::open(flags.device);
  if (const auto suspicion = suspected_order(device, recordings, model)) {
    fmt::print(stderr, "palpate: {} ({:.0f} nats; palpate check tells more)\n",
               in_flags(suspicion->words), suspicion->nats);
  }
  align(flags, model, objects);
  model.sensor.prior = prior ? *prior : estimate_prior(device, objects, model);
  std::vector<OccupancyGrid> maps;
  std::vector<std::optional<RotationalSymmetry>> symmetries;
  {
    Progress progress("building maps");
    MapBuilder builder(device, model);
    for (const ObjectTouches& object : objects) {
      const auto show = [&](double fraction) {
        progress.show((static_cast<double>(maps.size()) + fraction) /
                      static_cast<double>(objects.size()));
      };
      // What was learned is compared with more than log odds.
      maps.push_back(sensor ? observed_map(object.touches, model, object.label)
                            : build_map(builder, object, show));
      if (learns) {
        OccupancyGrid observed = observed_map(object.touches, model, object.label);
        maps.back().observations = std::move(observed.observations);
        maps.back().mean_level = std::move(observed.mean_level);
      }
      maps.back().mirror = flags.mirror;
      MapSource source{gathered(object, recordings.front().pressure_unit), model};
      if (!flags.group.empty()) {
        std::ranges::transform(grouped.sources[maps.size() - 1], std::back_inserter(source.groups),
                               &TouchSource::group);
      }
      judge_left_out(device, source);
      maps.back().source = std::make_shared<const MapSource>(std::move(source));
      settle_frame(origin, maps.back());
      symmetries.push_back(settle_symmetry(flags, maps.back()));
    }
  }

  const std::optional<MapSensor> learned =
      learns ? std::optional(learn_sensor(flags, maps, map_paths, model)) : std::nullopt;
  std::vector<WrittenMap> written;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    written.push_back(
        {map_paths[i], fmt::format("{} touches", objects[i].touches.size()), symmetries[i]});
  }
  write_maps(flags, maps, written, [&] {
    if (learned) {
      write_sensor(flags, *learned);
    }
  });
}

}  // namespace

void add_map(CLI::App& app) {
  auto* command = app.add_subcommand("map",
                                     "Build an object's occupancy grid from touches at known "
                                     "poses, with --unposed from presses at unknown poses, or "
                                     "from a drawing");
  const auto flags = std::make_shared<MapFlags>();
  add_map_flags(*command, *flags);
  add_drawing_flags(*command, *flags);
  command->callback([flags, command] {
    finish_map_flags(*command, *flags);
    if (flags->of_drawings()) {
      build_drawn_maps(*flags);
    } else if (flags->unposed) {
      build_unposed_maps(*flags);
    } else {
      build_maps(*flags);
    }
  });
}

}  // namespace palpate::cli
