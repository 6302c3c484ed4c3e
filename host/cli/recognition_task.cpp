#include "recognition_task.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "recordings.hpp"

namespace palpate::cli {

namespace {

/// The map files that an argument of --maps stands for: itself, or the maps of a folder.
std::vector<std::filesystem::path> map_files(const std::filesystem::path& argument) {
  std::error_code error;
  if (!std::filesystem::is_directory(argument, error)) {
    return {argument};
  }
  std::vector<std::filesystem::path> files;
  const std::filesystem::directory_iterator entries(argument, error);
  if (error) {
    throw Error(Fault::input, fmt::format("{}: cannot be read: {}; check its permissions",
                                          argument.string(), error.message()));
  }
  for (const auto& entry : entries) {
    if (entry.path().extension() == ".h5" && read_format(entry.path()) == "palpate.map") {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) {
    throw Error(Fault::input, fmt::format("{}: a folder without maps; build some with palpate map "
                                          "RECORDING... -o {}",
                                          argument.string(), (argument / "").string()));
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<Scene::Object> objects_of(const RecognizeOptions& options, const Scene& scene) {
  if (options.maps.empty()) {
    if (scene.objects.empty()) {
      throw Error(Fault::input,
                  options.scene.empty()
                      ? "--maps: missing; give the objects' maps, or a --scene with objects"
                      : fmt::format("{}: objects: missing; list the maps there or give --maps",
                                    options.scene));
    }
    return scene.objects;
  }
  std::vector<Scene::Object> objects;
  for (const std::string& argument : options.maps) {
    for (const std::filesystem::path& file : map_files(argument)) {
      objects.push_back({.map = file, .label = {}, .symmetry = {}});
    }
  }
  return objects;
}

void load_maps(const std::vector<Scene::Object>& objects, RecognitionTask& task) {
  std::set<std::filesystem::path> seen;
  for (const Scene::Object& object : objects) {
    OccupancyGrid map = read_map(object.map);
    if (!seen.insert(std::filesystem::canonical(object.map)).second) {
      throw Error(
          Fault::input,
          fmt::format("{}: the same map is given twice; leave one out, or give the object a "
                      "weight in a scene file",
                      object.map.string()));
    }
    map.label = object.label.value_or(map.label);
    map.symmetry = object.symmetry.value_or(map.symmetry);
    const auto known = std::find(task.labels.begin(), task.labels.end(), map.label);
    task.label_of.push_back(static_cast<std::size_t>(known - task.labels.begin()));
    if (known == task.labels.end()) {
      task.labels.push_back(map.label);
    }
    task.map_paths.push_back(object.map.string());
    task.hypotheses.push_back({std::move(map), object.weight});
  }
}

/// Maps recognised together share one prior: unequal ones favour the emptier or fuller map.
double common_prior(const RecognitionTask& task, std::optional<double> given) {
  if (given) {
    if (!(*given > 0.0 && *given < 1.0)) {
      throw Error(Fault::input,
                  fmt::format("--prior {}: give a probability between 0 and 1", *given));
    }
    return *given;
  }
  const double first = task.hypotheses.front().map.prior;
  for (std::size_t i = 1; i < task.hypotheses.size(); ++i) {
    const double prior = task.hypotheses[i].map.prior;
    if (std::abs(prior - first) > 1e-6) {
      throw Error(Fault::input,
                  fmt::format("{}: prior {} differs from {} of {}; build the maps in one call of "
                              "palpate map, or say which prior to use with --prior",
                              task.map_paths[i], prior, first, task.map_paths.front()));
    }
  }
  return first;
}

PoseLattice make_lattice(const RecognizeOptions& options, const Scene& scene) {
  PoseLattice lattice;
  const auto range = [](const char* flag, const std::string& text,
                        const std::optional<std::array<double, 2>>& key, Axis& axis, double unit) {
    const auto ends = text.empty() ? key : parse_range(flag, text);
    if (ends) {
      axis.lower = (*ends)[0] * unit;
      axis.upper = (*ends)[1] * unit;
    }
  };
  range("--x-mm", options.x_mm, scene.region.x_mm, lattice.x_mm, 1.0);
  range("--y-mm", options.y_mm, scene.region.y_mm, lattice.y_mm, 1.0);
  range("--theta-deg", options.theta_deg, scene.region.theta_deg, lattice.theta_rad, radians(1.0));
  const auto bins = options.bins.empty()     ? scene.bins
                    : options.bins == "auto" ? std::nullopt
                                             : std::optional(parse_bins("--bins", options.bins));
  if (bins) {
    lattice.x_mm.count = (*bins)[0];
    lattice.y_mm.count = (*bins)[1];
    lattice.theta_rad.count = (*bins)[2];
  }
  if (!options.pivot_mm.empty()) {
    lattice.pivot_mm = parse_point("--pivot-mm", options.pivot_mm);
  } else if (scene.region.pivot_mm) {
    lattice.pivot_mm = *scene.region.pivot_mm;
  }
  return lattice.collapse_fixed();
}

/// The weight of "none of these", which becomes the last label.
void add_none(std::optional<double> weight, RecognitionTask& task) {
  if (!weight) {
    return;
  }
  task.histogram.none_weight = require_above("--none", *weight, 0.0);
  const auto taken = std::find(task.labels.begin(), task.labels.end(), none_label);
  if (taken != task.labels.end()) {
    throw Error(Fault::input,
                fmt::format("--none: a map is labelled {}, as the hypothesis of an unknown object "
                            "is; label it otherwise in a scene file",
                            none_label));
  }
  task.labels.emplace_back(none_label);
}

/// Puts the scene's array in the place of the recordings' own.
void replace_array(const Scene& scene, const std::string& scene_file,
                   std::vector<Recording>& recordings) {
  if (!scene.array_mm) {
    return;
  }
  for (Recording& recording : recordings) {
    if (recording.elements() != scene.array_mm->size()) {
      throw Error(
          Fault::input,
          fmt::format("{}: pressure: {} elements, but array of {} has {}; use the "
                      "recording's own array by leaving the key out",
                      recording.path, recording.elements(), scene_file, scene.array_mm->size()));
    }
    recording.elements_mm = *scene.array_mm;
  }
}

std::vector<Unknown> list_unknowns(const RecognizeOptions& options,
                                   const std::vector<Recording>& recordings) {
  std::optional<Frames> frames;
  if (!options.frames.empty()) {
    frames = parse_frames("--frames", options.frames);
  }
  if (options.touches && *options.touches < 1) {
    throw Error(Fault::input, fmt::format("--touches {}: give at least 1", *options.touches));
  }
  if (options.touches && options.each_frame) {
    throw Error(Fault::input,
                "--touches: with --each-frame every unknown has one touch; leave one of them out");
  }
  std::vector<Unknown> unknowns;
  for (const Recording& recording : recordings) {
    auto [begin, end] = select(recording, frames);
    if (options.touches && static_cast<std::size_t>(*options.touches) > end - begin) {
      throw Error(Fault::input, fmt::format("{}: has {} touches; --touches {} is too many",
                                            recording.path, end - begin, *options.touches));
    }
    if (options.each_frame) {
      for (std::size_t i = begin; i < end; ++i) {
        unknowns.push_back({&recording, i, {recording.touch(i)}});
      }
    } else {
      end = options.touches ? begin + static_cast<std::size_t>(*options.touches) : end;
      unknowns.push_back({&recording, {}, recording.touches(begin, end)});
    }
  }
  return unknowns;
}

/// Presses one by one of one large array that never moves share most of the work.
bool array_is_still(const std::vector<Unknown>& unknowns, bool each_frame) {
  constexpr std::size_t large = 256;
  const Touch& first = unknowns.front().touches.front();
  return each_frame && unknowns.size() > 1 && first.elements_mm.size() >= large &&
         std::all_of(unknowns.begin(), unknowns.end(), [&](const Unknown& unknown) {
           return same_placement(unknown.touches.front(), first);
         });
}

/// Whether the particle filter is asked for. Throws Error on a filter that there is not, and on
/// flags that the other one would leave without effect.
bool wants_particles(const RecognizeOptions& options, const Scene& scene) {
  const std::string filter =
      !options.filter.empty() ? options.filter : scene.filter.value_or("auto");
  if (filter == "bounded") {
    throw Error(Fault::input,
                fmt::format("--filter {}: not in this version yet; use histogram", filter));
  }
  if (filter != "auto" && filter != "histogram" && filter != "particles") {
    throw Error(Fault::input,
                fmt::format("--filter {}: not known; use histogram or particles", filter));
  }
  const bool particles = filter == "particles";
  if (particles && !options.posterior.empty()) {
    throw Error(Fault::input, fmt::format("--posterior {}: particles have no bins; use --filter "
                                          "histogram",
                                          options.posterior));
  }
  for (const auto& [flag, given] : {std::pair{"--particles", options.particles.has_value()},
                                    std::pair{"--resampling", !options.resampling.empty()},
                                    std::pair{"--augmented", options.augmented},
                                    std::pair{"--seed", options.seed.has_value()}}) {
    if (given && !particles) {
      throw Error(
          Fault::input,
          fmt::format("{}: has no effect on --filter {}; add --filter particles", flag, filter));
    }
  }
  return particles;
}

/// What the histogram's options and the flags say to the particle filter.
ParticleOptions particle_options(const RecognizeOptions& options,
                                 const HistogramOptions& histogram) {
  ParticleOptions particles{.region = histogram.lattice,
                            .classifier = histogram.classifier,
                            .gamma = histogram.gamma,
                            .prior = histogram.prior,
                            .none_weight = histogram.none_weight,
                            .augmented = options.augmented};
  particles.particles = options.particles.value_or(particles.particles);
  if (particles.particles < 1 || particles.particles > 1'000'000) {
    throw Error(Fault::input,
                fmt::format("--particles {}: give 1 to 1,000,000", particles.particles));
  }
  if (options.resampling == "systematic") {
    particles.resampling = Resampling::systematic;
  } else if (!options.resampling.empty() && options.resampling != "multinomial") {
    throw Error(Fault::input, fmt::format("--resampling {}: not known; use multinomial or "
                                          "systematic",
                                          options.resampling));
  }
  particles.seed = options.seed.value_or(particles.seed);
  return particles;
}

}  // namespace

RecognitionTask prepare(const RecognizeOptions& options) {
  const Scene scene = options.scene.empty() ? Scene{} : read_scene(options.scene);
  RecognitionTask task;
  const bool with_particles = wants_particles(options, scene);
  task.histogram.lattice = make_lattice(options, scene);
  task.auto_bins = options.bins.empty() ? scene.auto_bins : options.bins == "auto";
  task.histogram.gamma = options.gamma ? *options.gamma : scene.gamma.value_or(0.1);
  if (!(task.histogram.gamma >= 0.0 && task.histogram.gamma < 1.0)) {
    throw Error(Fault::input,
                fmt::format("--gamma {}: must be at least 0 and below 1", task.histogram.gamma));
  }
  task.recordings = read_touch_recordings(options.recordings);
  replace_array(scene, options.scene, task.recordings);
  task.histogram.classifier =
      make_classifier(task.recordings, options.threshold ? options.threshold : scene.threshold,
                      options.ratio ? options.ratio : scene.ratio);
  task.unknowns = list_unknowns(options, task.recordings);
  task.histogram.still_array = array_is_still(task.unknowns, options.each_frame);
  if (options.memory_mib) {
    if (*options.memory_mib < 1) {
      throw Error(Fault::input,
                  fmt::format("--memory-mib {}: give at least 1", *options.memory_mib));
    }
    task.histogram.memory_limit_bytes = static_cast<std::uint64_t>(*options.memory_mib) << 20;
  }
  load_maps(objects_of(options, scene), task);
  add_none(options.none ? options.none : scene.none, task);
  task.histogram.prior = common_prior(task, options.prior ? options.prior : scene.prior);
  if (with_particles) {
    task.particles = particle_options(options, task.histogram);
  }
  task.device = options.device.empty() ? scene.device.value_or("") : options.device;
  return task;
}

}  // namespace palpate::cli
