#include "cli/map_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "cli/calibrate_output.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "learning/calibration_task.hpp"
#include "model/option_words.hpp"
#include "palpate/files.hpp"
#include "recognition/folder_sensor.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

/// Touches of each of two objects that it takes to learn how sure to be of several.
constexpr std::size_t least_touches = 15;
/// Presses at unknown poses that it takes, of each of two objects: two in each part left out.
constexpr std::size_t least_presses = 10;

/// A map of the folder and its file.
struct FolderMap {
  std::filesystem::path file;
  OccupancyGrid map;
};

/// The maps in the folder of --output but for those that are written anew.
std::vector<std::filesystem::path> other_maps(const MapFlags& flags,
                                              const std::vector<std::filesystem::path>& written) {
  std::vector<std::filesystem::path> others;
  std::error_code none;
  if (std::filesystem::is_directory(flags.output, none)) {
    for (const std::filesystem::path& file : maps_in(flags.output)) {
      if (std::ranges::none_of(written, [&](const std::filesystem::path& own) {
            return own.lexically_normal() == file.lexically_normal();
          })) {
        others.push_back(file);
      }
    }
  }
  return others;
}

/// The maps of the folder as they will be. Throws Error where a map that stays does not tell what
/// learning needs.
std::vector<FolderMap> folder_maps(const MapFlags& flags, const std::vector<OccupancyGrid>& maps,
                                   const std::vector<std::filesystem::path>& written) {
  std::vector<FolderMap> all;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    all.push_back({written[i], maps[i]});
  }
  for (const std::filesystem::path& file : other_maps(flags, written)) {
    all.push_back({file, read_map(file)});
    const OccupancyGrid& map = all.back().map;
    if (!map.source || map.mean_level.empty()) {
      refuse(file, "holds no {}; build it anew from its recordings with palpate map -o {}",
             map.source ? "mean pressures" : "touches at known poses", flags.output);
    }
    const std::string& unit = map.source->touches.pressure_unit;
    if (unit != maps.front().source->touches.pressure_unit) {
      refuse(file, "its touches are in {}, others in {}; keep them in folders of their own", unit,
             maps.front().source->touches.pressure_unit);
    }
  }
  // What is learned does not depend on the order in which objects join the folder.
  std::ranges::sort(all, {}, [](const FolderMap& map) { return map.file.filename(); });
  return all;
}

/// The touches of the maps, in the frames of these.
std::vector<Recording> touches_of(const std::vector<FolderMap>& maps) {
  std::vector<Recording> touches;
  for (const auto& [file, map] : maps) {
    Recording& own = touches.emplace_back(map.source->touches);
    own.path = file.string();
    own.object = map.label;
    for (Pose& pose : own.T_robot_sensor) {
      pose.translation_mm -= map.centred_mm;
    }
  }
  return touches;
}

/// Gives presses, of all touches of the maps in turn, the groups that the maps know.
void give_groups(const std::vector<FolderMap>& maps, std::vector<Press>& presses) {
  auto press = presses.begin();
  for (const auto& [file, map] : maps) {
    const std::vector<std::string>& groups = map.source->groups;
    for (std::size_t touch = 0; touch < map.source->touches.size(); ++touch, ++press) {
      press->group = groups.empty() ? "" : groups[touch];
    }
  }
}

/// Throws Error where there are fewer than `least` touches of each of two objects.
void require_enough(const std::vector<Press>& touches, std::size_t least) {
  std::map<std::string, std::size_t> counts;
  for (const Press& own : touches) {
    ++counts[own.label];
  }
  if (std::ranges::count_if(counts, [&](const auto& of) { return of.second >= least; }) < 2) {
    throw Error(Fault::input,
                fmt::format("it takes {} touches or more of each of two objects", least));
  }
}

/// "0.158 +-0.031 less, beyond chance"
std::string words_of(const LossDifference& less, const std::string& amount) {
  const LossDifference more{-less.mean, less.standard_error};
  return fmt::format("{} {}, {} chance", amount, less.mean < 0.0 ? "more" : "less",
                     less.is_clear() || more.is_clear() ? "beyond" : "within");
}

std::string words_of(const SensorGain& gain, const std::string& file, std::size_t touches) {
  std::string scores = fmt::format(
      "touches that are left out have a log-loss of {:.3f} nats, {:.3f} by Eq. 7 ({})",
      gain.log_loss, gain.log_loss_before,
      words_of(gain.less_loss, fmt::format("{:.3f} +-{:.2g}", std::abs(gain.less_loss.mean),
                                           gain.less_loss.standard_error)));
  if (gain.error_mm) {
    const double share = *gain.error_mm / gain.error_mm_before.value();
    scores += fmt::format(
        ", and {} of them together a pose error of {:.2f} mm, {:.2f} by Eq. 7 ({})",
        presses_in_group, *gain.error_mm, *gain.error_mm_before,
        words_of(gain.less_error, fmt::format("{:.0f} +-{:.0f} %", 100.0 * std::abs(1.0 - share),
                                              100.0 * share * gain.less_error.standard_error)));
  }
  if (!gain.better) {
    return fmt::format("no sensor model, as {}: {}",
                       gain.gains ? "it gains on the one and loses on the other"
                                  : "it is not better beyond chance, two standard errors",
                       scores);
  }
  return fmt::format(
      "{}: learned from {} touches: {}\n"
      "{}: recognition with this folder takes it, unless --sensor-model none is given",
      file, touches, scores, file);
}

/// What touches say of the sensor. Throws Error where they do not tell whether it is better.
MapSensor learned_from(const CalibrationTask& task, const MapFlags& flags) {
  Progress progress("learning the sensor");
  SensorCalibration calibration = calibrate_sensor(
      task.presses, task.maps, task.options, [&](double fraction) { progress.show(fraction); });
  if (!calibration.gain) {
    throw Error(Fault::input, "the touches do not tell how much better it is; give more of them");
  }
  MapSensor learned{
      .words = words_of(*calibration.gain, sensor_file(flags).string(), task.presses.size())};
  if (calibration.gain->better) {
    learned.sensor = std::move(calibration.sensor);
  }
  return learned;
}

/// What `learn` returns, or why no sensor can be learned.
template <typename Learn>
MapSensor or_why_not(const Learn& learn) {
  try {
    return learn();
  } catch (const Error& error) {
    if (error.fault() != Fault::input) {
      throw;
    }
    return {.sensor = {}, .words = fmt::format("no sensor model: {}", in_flags(error.what()))};
  }
}

/// Whether `palpate map` wrote a sensor model, and whether recognition can read it.
enum class Origin { own, foreign, unreadable };
Origin origin_of(const std::filesystem::path& file) {
  try {
    return read_sensor_model(file).maps.empty() ? Origin::foreign : Origin::own;
  } catch (const Error& error) {
    if (error.fault() != Fault::input) {
      throw;
    }
    return Origin::unreadable;
  }
}

}  // namespace

std::filesystem::path sensor_file(const MapFlags& flags) {
  return std::filesystem::path(flags.output) / folder_sensor_name;
}

bool learns_sensor(const MapFlags& flags) {
  if (!flags.to_folder()) {
    return false;
  }
  const bool asked = flags.request.sensor_model.empty();
  const std::filesystem::path file = sensor_file(flags);
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return asked;
  }
  const Origin origin = origin_of(file);
  if (origin == Origin::own && !asked) {
    tell_on_stderr(fmt::format(
        "{}: stays, and was learned for earlier maps: recognition leaves it out with others; "
        "remove it, or build the maps without --sensor-model",
        file.string()));
  } else if (origin == Origin::foreign && asked) {
    tell_on_stderr(fmt::format(
        "{0}: was not written by palpate map, and stays; no sensor is learned. To recognise with "
        "it, give --sensor-model {0} here and to recognition",
        file.string()));
  } else if (origin == Origin::unreadable) {
    tell_on_stderr(fmt::format(
        "{}: was not written by palpate map, and stays; {}it is no sensor model, and recognition "
        "with maps of this folder refuses it until it is mended or moved",
        file.string(), asked ? "no sensor is learned; " : ""));
  }
  return asked && origin == Origin::own;
}

MapSensor learn_sensor(const MapFlags& flags, const std::vector<OccupancyGrid>& maps,
                       const std::vector<std::filesystem::path>& written, const MapOptions& model) {
  return or_why_not([&] {
    const std::vector<FolderMap> all = folder_maps(flags, maps, written);
    const std::vector<Recording> touches = touches_of(all);
    CalibrationTask task = calibration_task(
        {}, {.threshold = flags.request.threshold, .ratio = flags.request.ratio}, touches, {});
    require_enough(task.presses, least_touches);
    give_groups(all, task.presses);
    task.options.maps = model;
    MapSensor learned = learned_from(task, flags);
    if (learned.sensor) {
      learned.sensor->touch_sd = touch_sd(flags);
      for (const auto& [file, map] : all) {
        learned.sensor->maps[file.filename().string()] = digest_of(map);
      }
      if (const std::string words = unlearned_strangers(*learned.sensor); !words.empty()) {
        learned.words += fmt::format("\n{}: {}", sensor_file(flags).string(), words);
      }
    }
    return learned;
  });
}

MapSensor learn_unposed_sensor(const MapFlags& flags, const std::vector<Recording>& recordings,
                               const std::vector<std::filesystem::path>& written) {
  return or_why_not([&] {
    if (const auto others = other_maps(flags, written); !others.empty()) {
      refuse(others.front(), "stays, and its presses are not at hand; build all maps of {} at once",
             flags.output);
    }
    std::vector<Recording> labelled = recordings;
    for (Recording& recording : labelled) {
      if (!flags.label.empty()) {
        const std::string group = grouped_object(recording, flags.group).group;
        recording.object = flags.group == "label" ? flags.label + "@" + group : flags.label;
      }
    }
    const CalibrationTask task = calibration_task({.unposed = true, .group = flags.group},
                                                  {.threshold = flags.request.threshold,
                                                   .ratio = flags.request.ratio,
                                                   .frames = flags.request.frames},
                                                  labelled, {});
    require_enough(task.presses, least_presses);
    return learned_from(task, flags);
  });
}

void write_sensor(const MapFlags& flags, const MapSensor& learned) {
  const std::filesystem::path file = sensor_file(flags);
  std::error_code ignored;
  if (learned.sensor) {
    write_sensor_model(file, *learned.sensor);
  } else if (std::filesystem::remove(file, ignored)) {
    fmt::print("{}: removed, as it was learned for other maps\n", file.string());
  }
  fmt::print("{}\n", learned.words);
}

}  // namespace palpate::cli
