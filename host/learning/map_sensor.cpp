#include "learning/map_task.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "learning/sensor_calibration.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "recognition/recordings.hpp"
#include "recognition/request.hpp"

namespace palpate {

namespace {

/// Touches of each of two objects that it takes to learn how sure to be of several.
constexpr std::size_t least_touches = 15;
/// Presses at unknown poses that it takes, of each of two objects: two in each part left out.
constexpr std::size_t least_presses = 10;

/// Maps of the folder by their files: what is learned does not depend on the order in which objects
/// join the folder.
using FolderMaps = std::map<std::filesystem::path, OccupancyGrid>;

/// The maps in the folder but for those that are written anew.
std::vector<std::filesystem::path> other_maps(const MapRequest& request,
                                              const std::vector<std::string>& names) {
  std::vector<std::filesystem::path> others;
  std::error_code none;
  if (std::filesystem::is_directory(request.output, none)) {
    for (const std::filesystem::path& file : maps_in(request.output)) {
      if (std::ranges::none_of(names, [&](const std::string& name) {
            return request.map_file(name).lexically_normal() == file.lexically_normal();
          })) {
        others.push_back(file);
      }
    }
  }
  return others;
}

/// The maps of the folder as they will be. Throws Error where a map that stays does not tell what
/// learning needs.
FolderMaps folder_maps(const MapTask& task, const LearnedMaps& learned) {
  const MapRequest& request = task.request;
  FolderMaps all;
  for (const auto& [name, map] : learned.maps) {
    all.emplace(request.map_file(name).lexically_normal(), map);
  }
  for (const std::filesystem::path& file : other_maps(request, task.names())) {
    const OccupancyGrid& map = all.emplace(file.lexically_normal(), read_map(file)).first->second;
    if (!map.source || map.mean_level.empty()) {
      refuse(file, "holds no {}; build it anew from its recordings with palpate map -o {}",
             map.source ? "mean pressures" : "touches at known poses", request.output);
    }
    const std::string& unit = map.source->touches.pressure_unit;
    if (unit != task.recordings.front().pressure_unit) {
      refuse(file, "its touches are in {}, others in {}; keep them in folders of their own", unit,
             task.recordings.front().pressure_unit);
    }
  }
  return all;
}

/// The touches of the maps, in the frames of these.
std::vector<Recording> touches_of(const FolderMaps& maps) {
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
void give_groups(const FolderMaps& maps, std::vector<Press>& presses) {
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

std::string words_of(const SensorGain& gain) {
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
  return scores;
}

/// Adds what touches say of the sensor. Throws Error where they do not tell whether it is better.
void learn_from(const CalibrationTask& task, const MapRequest& request, LearnedMaps& learned,
                const std::function<void(double)>& progress) {
  SensorCalibration calibration = calibrate_sensor(task.presses, task.maps, task.options, progress);
  if (!calibration.gain) {
    throw Error(Fault::input, "the touches do not tell how much better it is; give more of them");
  }
  const SensorGain& gain = *calibration.gain;
  if (!gain.better) {
    learned.words.push_back(fmt::format("no sensor model, as {}: {}",
                                        gain.gains
                                            ? "it gains on the one and loses on the other"
                                            : "it is not better beyond chance, two standard errors",
                                        words_of(gain)));
    return;
  }
  const std::string file = request.sensor_file().string();
  learned.words.push_back(
      fmt::format("{}: learned from {} touches: {}", file, task.presses.size(), words_of(gain)));
  if (!request.output.empty()) {
    learned.words.push_back(fmt::format(
        "{}: recognition with this folder takes it, unless `sensor-model none` is given", file));
  }
  learned.sensor = std::move(calibration.sensor);
}

/// Runs `learn`, or says why no sensor can be learned. Where none is, one of other maps goes.
template <typename Learn>
void or_say_why_not(const MapRequest& request, LearnedMaps& learned, const Learn& learn) {
  if (const auto fault = input_fault_of(learn)) {
    learned.words.push_back(fmt::format("no sensor model: {}", *fault));
  }
  std::error_code ignored;
  if (!learned.sensor && !request.output.empty() &&
      std::filesystem::exists(request.sensor_file(), ignored)) {
    learned.words.push_back(fmt::format("{}: removed, as it was learned for other maps",
                                        request.sensor_file().string()));
  }
}

/// Whether learn_maps() wrote a sensor model; none where it is no sensor model.
std::optional<bool> is_of_maps(const std::filesystem::path& file) {
  std::optional<bool> own;
  input_fault_of([&] { own = !read_sensor_model(file).maps.empty(); });
  return own;
}

}  // namespace

bool learns_sensor(const MapRequest& request, std::vector<std::string>& remarks) {
  const bool asked = request.to_folder() && request.shared.sensor_model.empty();
  const std::filesystem::path file = request.sensor_file();
  std::error_code ignored;
  if (!request.to_folder() || request.output.empty() || !std::filesystem::exists(file, ignored)) {
    return asked;
  }
  const std::optional<bool> own = is_of_maps(file);
  if (!own) {
    remarks.push_back(fmt::format(
        "{}: was not written by palpate map, and stays; {}it is no sensor model, and recognition "
        "with maps of this folder refuses it until it is mended or moved",
        file.string(), asked ? "no sensor is learned; " : ""));
  } else if (*own && !asked) {
    remarks.push_back(fmt::format(
        "{}: stays, and was learned for earlier maps: recognition leaves it out with others; "
        "remove it, or build the maps without `sensor-model`",
        file.string()));
  } else if (!*own && asked) {
    remarks.push_back(fmt::format(
        "{0}: was not written by palpate map, and stays; no sensor is learned. To recognise with "
        "it, give `sensor-model {0}` here and to recognition",
        file.string()));
  }
  return asked && own.value_or(false);
}

void learn_sensor(const MapTask& task, const MapOptions& options, LearnedMaps& learned,
                  const std::function<void(double)>& progress) {
  const MapRequest& request = task.request;
  or_say_why_not(request, learned, [&] {
    const FolderMaps all = folder_maps(task, learned);
    const std::vector<Recording> touches = touches_of(all);
    CalibrationTask calibration = calibration_task(
        {}, {.threshold = request.shared.threshold, .ratio = request.shared.ratio}, touches, {});
    require_enough(calibration.presses, least_touches);
    give_groups(all, calibration.presses);
    calibration.options.readings.maps = options;
    learn_from(calibration, request, learned, progress);
    if (!learned.sensor) {
      return;
    }
    learned.sensor->touch_sd = request.touch_sd();
    for (const auto& [file, map] : all) {
      learned.sensor->maps[file.filename().string()] = digest_of(map);
    }
    if (const std::string words = unlearned_strangers(*learned.sensor); !words.empty()) {
      learned.words.push_back(fmt::format("{}: {}", request.sensor_file().string(), words));
    }
  });
}

void learn_unposed_sensor(const MapTask& task, LearnedMaps& learned,
                          const std::function<void(double)>& progress) {
  const MapRequest& request = task.request;
  or_say_why_not(request, learned, [&] {
    if (const auto others = other_maps(request, task.names()); !others.empty()) {
      refuse(others.front(), "stays, and its presses are not at hand; build all maps of {} at once",
             request.output);
    }
    std::vector<Recording> labelled(task.recordings.begin(), task.recordings.end());
    for (Recording& recording : labelled) {
      if (!request.label.empty()) {
        const std::string group = grouped_object(recording, request.group).group;
        recording.object = request.group == "label" ? request.label + "@" + group : request.label;
      }
    }
    const CalibrationTask calibration = calibration_task({.unposed = true, .group = request.group},
                                                         {.threshold = request.shared.threshold,
                                                          .ratio = request.shared.ratio,
                                                          .frames = request.shared.frames},
                                                         labelled, {});
    require_enough(calibration.presses, least_presses);
    learn_from(calibration, request, learned, progress);
  });
}

}  // namespace palpate
