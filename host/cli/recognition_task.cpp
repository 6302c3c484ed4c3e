#include "recognition_task.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "file_identity.hpp"
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

std::vector<Scene::Object> objects_of(const RecognitionFlags& flags, const Scene& scene) {
  if (flags.maps.empty()) {
    if (scene.objects.empty()) {
      throw Error(Fault::input,
                  flags.scene.empty()
                      ? "--maps: missing; give the objects' maps, or a --scene with objects"
                      : fmt::format("{}: objects: missing; list the maps there or give --maps",
                                    flags.scene));
    }
    return scene.objects;
  }
  std::vector<Scene::Object> objects;
  for (const std::string& argument : flags.maps) {
    for (const std::filesystem::path& file : map_files(argument)) {
      objects.push_back({.map = file, .label = {}, .symmetry = {}});
    }
  }
  return objects;
}

void load_maps(const std::vector<Scene::Object>& objects, RecognitionTask& task) {
  std::set<std::optional<FileIdentity>> seen;
  for (const Scene::Object& object : objects) {
    OccupancyGrid map = read_map(object.map);
    if (!seen.insert(identity_of(object.map)).second) {
      throw Error(
          Fault::input,
          fmt::format("{}: the same map is given twice; leave one out, or give the object a "
                      "weight in a scene file",
                      object.map.string()));
    }
    map.label = object.label.value_or(map.label);
    if (map.label == none_label) {
      throw Error(Fault::input,
                  fmt::format("{}: label {} is kept for objects that were never learned; label the "
                              "map otherwise in the scene file",
                              object.map.string(), none_label));
    }
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

/// The prior that was given, if any. Throws Error where none was and the maps' own differ.
std::optional<double> prior_of(const RecognitionTask& task, std::optional<double> given) {
  if (given && !(*given > 0.0 && *given < 1.0)) {
    throw Error(Fault::input,
                fmt::format("--prior {}: give a probability between 0 and 1", *given));
  }
  if (const auto other = given ? std::nullopt : differing_prior(task.hypotheses)) {
    throw Error(Fault::input,
                fmt::format("{}: prior {} differs from {} of {}; build the maps in one call of "
                            "palpate map, or say which prior to use with --prior",
                            task.map_paths[*other], task.hypotheses[*other].map.prior,
                            task.hypotheses.front().map.prior, task.map_paths.front()));
  }
  return given;
}

PoseLattice make_lattice(const RecognitionFlags& flags, const Scene& scene) {
  PoseLattice lattice;
  const auto range = [](const char* flag, const std::string& text,
                        const std::optional<std::array<double, 2>>& key, Axis& axis, double unit) {
    const auto ends = text.empty() ? key : parse_range(flag, text);
    if (!ends) {
      return;
    }
    axis.lower = (*ends)[0] * unit;
    axis.upper = (*ends)[1] * unit;
    if (!(axis.lower >= -farthest_mm && axis.upper <= farthest_mm)) {
      const std::string given = text.empty() ? fmt::format("{}:{}", (*ends)[0], (*ends)[1]) : text;
      throw Error(Fault::input, fmt::format("{} {}: give numbers within +-{:g}", flag, given,
                                            farthest_mm / unit));
    }
  };
  range("--x-mm", flags.x_mm, scene.region.x_mm, lattice.x_mm, 1.0);
  range("--y-mm", flags.y_mm, scene.region.y_mm, lattice.y_mm, 1.0);
  range("--theta-deg", flags.theta_deg, scene.region.theta_deg, lattice.theta_rad, radians(1.0));
  const auto bins = flags.bins.empty()     ? scene.bins
                    : flags.bins == "auto" ? std::nullopt
                                           : std::optional(parse_bins("--bins", flags.bins));
  if (bins) {
    lattice.x_mm.count = (*bins)[0];
    lattice.y_mm.count = (*bins)[1];
    lattice.theta_rad.count = (*bins)[2];
  }
  if (!flags.pivot_mm.empty()) {
    lattice.pivot_mm = parse_point("--pivot-mm", flags.pivot_mm);
  } else if (scene.region.pivot_mm) {
    lattice.pivot_mm = *scene.region.pivot_mm;
  }
  if (!(std::abs(lattice.pivot_mm.x) <= farthest_mm &&
        std::abs(lattice.pivot_mm.y) <= farthest_mm)) {
    throw Error(Fault::input, fmt::format("--pivot-mm {},{}: give numbers within +-{:g}",
                                          lattice.pivot_mm.x, lattice.pivot_mm.y, farthest_mm));
  }
  return lattice.collapse_fixed();
}

/// The weight of "none of these", which becomes the last label.
void add_none(std::optional<double> weight, RecognitionTask& task) {
  if (!weight) {
    return;
  }
  task.histogram.none_weight = require_above("--none", *weight, 0.0);
  task.labels.emplace_back(none_label);
}

/// Whether the particle filter is asked for. Throws Error on a filter that there is not, and on
/// flags that the other one would leave without effect.
bool wants_particles(const RecognitionFlags& flags, const Scene& scene) {
  const std::string filter = !flags.filter.empty() ? flags.filter : scene.filter.value_or("auto");
  if (filter == "bounded") {
    throw Error(Fault::input,
                fmt::format("--filter {}: not in this version yet; use histogram", filter));
  }
  if (filter != "auto" && filter != "histogram" && filter != "particles") {
    throw Error(Fault::input,
                fmt::format("--filter {}: not known; use histogram or particles", filter));
  }
  const bool particles = filter == "particles";
  for (const auto& [flag, given] :
       {std::pair{"--particles", flags.particles.has_value()},
        std::pair{"--resampling", !flags.resampling.empty()},
        std::pair{"--augmented", flags.augmented}, std::pair{"--seed", flags.seed.has_value()}}) {
    if (given && !particles) {
      throw Error(
          Fault::input,
          fmt::format("{}: has no effect on --filter {}; add --filter particles", flag, filter));
    }
  }
  if (flags.memory_mib && particles) {
    throw Error(Fault::input,
                "--memory-mib: has no effect on --filter particles; use --filter histogram, or "
                "fewer --particles");
  }
  return particles;
}

/// What the histogram's options and the flags say to the particle filter.
ParticleOptions particle_options(const RecognitionFlags& flags, const HistogramOptions& histogram) {
  ParticleOptions particles{.region = histogram.lattice,
                            .contact = histogram.contact,
                            .none_weight = histogram.none_weight,
                            .augmented = flags.augmented};
  particles.particles = flags.particles.value_or(particles.particles);
  if (particles.particles < 1 || particles.particles > 1'000'000) {
    throw Error(Fault::input,
                fmt::format("--particles {}: give 1 to 1,000,000", particles.particles));
  }
  if (flags.resampling == "systematic") {
    particles.resampling = Resampling::systematic;
  } else if (!flags.resampling.empty() && flags.resampling != "multinomial") {
    throw Error(Fault::input, fmt::format("--resampling {}: not known; use multinomial or "
                                          "systematic",
                                          flags.resampling));
  }
  particles.seed = flags.seed.value_or(particles.seed);
  return particles;
}

}  // namespace

Scene scene_of(const RecognitionFlags& flags) {
  return flags.scene.empty() ? Scene{} : read_scene(flags.scene);
}

void replace_array(const Scene& scene, const std::string& scene_file, const std::string& source,
                   std::size_t elements, std::vector<glm::dvec2>& elements_mm) {
  if (!scene.array_mm) {
    return;
  }
  if (elements != scene.array_mm->size()) {
    throw Error(Fault::input,
                fmt::format("{}: pressure: {} elements, but array of {} has {}; use its own array "
                            "by leaving the key out",
                            source, elements, scene_file, scene.array_mm->size()));
  }
  elements_mm = *scene.array_mm;
}

RecognitionTask prepare(const RecognitionFlags& flags, const Scene& scene,
                        const std::string& pressure_unit, const std::string& source) {
  RecognitionTask task;
  const bool with_particles = wants_particles(flags, scene);
  task.histogram.lattice = make_lattice(flags, scene);
  task.auto_bins = flags.bins.empty() ? scene.auto_bins : flags.bins == "auto";
  task.histogram.contact.gamma = flags.gamma ? *flags.gamma : scene.gamma.value_or(0.1);
  if (!(task.histogram.contact.gamma >= 0.0 && task.histogram.contact.gamma < 1.0)) {
    throw Error(Fault::input, fmt::format("--gamma {}: must be at least 0 and below 1",
                                          task.histogram.contact.gamma));
  }
  task.histogram.contact.classifier =
      make_classifier(pressure_unit, source, flags.threshold ? flags.threshold : scene.threshold,
                      flags.ratio ? flags.ratio : scene.ratio);
  if (flags.memory_mib) {
    if (*flags.memory_mib < 1) {
      throw Error(Fault::input, fmt::format("--memory-mib {}: give at least 1", *flags.memory_mib));
    }
    task.histogram.memory_limit_bytes = static_cast<std::uint64_t>(*flags.memory_mib) << 20;
  }
  load_maps(objects_of(flags, scene), task);
  add_none(flags.none ? flags.none : scene.none, task);
  task.histogram.contact.prior = prior_of(task, flags.prior ? flags.prior : scene.prior);
  if (with_particles) {
    task.particles = particle_options(flags, task.histogram);
  }
  task.device = flags.device.empty() ? scene.device.value_or("") : flags.device;
  return task;
}

void add_recognition_files(const RecognitionFlags& flags, const Scene& scene,
                           const RecognitionTask& task, CommandFiles& files) {
  if (!flags.scene.empty()) {
    files.reads("--scene", flags.scene);
  }
  if (scene.array_file) {
    files.reads("--scene", *scene.array_file);
  }
  for (const std::string& map : task.map_paths) {
    files.reads(flags.maps.empty() ? "--scene" : "--maps", map);
  }
}

}  // namespace palpate::cli
