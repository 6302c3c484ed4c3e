#include "cli/recognition_flags.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "cli/map_files.hpp"
#include "cli/options.hpp"
#include "cli/recordings.hpp"
#include "cli/sensor_model_flag.hpp"
#include "io/file_identity.hpp"
#include "model/option_words.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/files.hpp"

namespace palpate::cli {

namespace {

std::vector<Scene::Object> objects_of(const RecognitionFlags& flags, const Scene& scene) {
  if (!flags.given_maps.empty()) {
    std::vector<Scene::Object> objects;
    for (const GivenMap& given : flags.given_maps) {
      objects.push_back({.map = given.name, .label = {}, .symmetry = {}, .mirror = {}});
    }
    return objects;
  }
  if (flags.maps.empty()) {
    if (scene.objects.empty()) {
      if (flags.scene.empty()) {
        refuse("--maps", "missing; give the objects' maps, or a --scene with objects");
      }
      refuse(flags.scene, "objects: missing; list the maps there or give --maps");
    }
    return scene.objects;
  }
  std::vector<Scene::Object> objects;
  for (const std::string& argument : flags.maps) {
    for (const std::filesystem::path& file : map_files(argument)) {
      objects.push_back({.map = file, .label = {}, .symmetry = {}, .mirror = {}});
    }
  }
  return objects;
}

std::vector<Hypothesis> hypotheses_of(const RecognitionFlags& flags,
                                      const std::vector<Scene::Object>& objects) {
  std::vector<Hypothesis> hypotheses;
  if (!flags.given_maps.empty()) {
    for (const GivenMap& given : flags.given_maps) {
      hypotheses.push_back(given.hypothesis);
    }
    return hypotheses;
  }
  std::set<std::optional<FileIdentity>> seen;
  for (const Scene::Object& object : objects) {
    OccupancyGrid map = read_map(object.map);
    if (!seen.insert(identity_of(object.map)).second) {
      refuse(object.map,
             "the map is given twice; leave one out, or give the object a weight in a scene file");
    }
    map.label = object.label.value_or(map.label);
    if (map.label == none_label) {
      refuse(object.map,
             "label {} stands for objects that were never learned; give the map another label in "
             "the scene file",
             none_label);
    }
    map.symmetry = object.symmetry.value_or(map.symmetry);
    map.mirror = object.mirror.value_or(map.mirror);
    hypotheses.push_back({std::move(map), object.weight});
  }
  return hypotheses;
}

/// The prior that was given, if any. Throws Error where none was and the maps' own differ.
std::optional<double> prior_of(const std::vector<Scene::Object>& objects,
                               const std::vector<Hypothesis>& hypotheses,
                               std::optional<double> given) {
  if (given && !(*given > 0.0 && *given < 1.0)) {
    refuse_flag("--prior", *given, "give a probability between 0 and 1");
  }
  if (const auto other = given ? std::nullopt : differing_prior(hypotheses)) {
    refuse(objects[*other].map,
           "prior {} differs from {} of {}; build the maps in one call of palpate map, or say "
           "which prior to use with --prior",
           hypotheses[*other].map.prior, hypotheses.front().map.prior,
           objects.front().map.string());
  }
  return given;
}

/// The classifier of Eq. 3 and gamma of Eq. 7: a flag overrides the scene's key, and the key what
/// the sensor model learned.
std::pair<ContactClassifier, double> contact_rules(const RecognitionFlags& flags,
                                                   const Scene& scene,
                                                   const std::optional<LearnedSensor>& sensor,
                                                   const std::string& pressure_unit,
                                                   const std::string& source) {
  constexpr double usual_gamma = 0.1;
  const auto given = [](std::optional<double> flag, std::optional<double> key,
                        std::optional<double> learned) {
    return flag ? flag : key ? key : learned;
  };
  const auto learned = [&](double value) { return sensor ? std::optional(value) : std::nullopt; };
  const LearnedSensor values = sensor.value_or(LearnedSensor{});
  const double gamma = given(flags.gamma, scene.gamma, learned(values.gamma)).value_or(usual_gamma);
  if (!(gamma >= 0.0 && gamma < 1.0)) {
    refuse_flag("--gamma", gamma, "must be at least 0 and below 1");
  }
  return {
      make_classifier(pressure_unit, source,
                      given(flags.threshold, scene.threshold, learned(values.classifier.threshold)),
                      given(flags.ratio, scene.ratio, learned(values.classifier.ratio))),
      gamma};
}

/// The file of every hypothesis's map; a mirror image has that of the object before it.
std::vector<std::string> paths_of(const std::vector<Scene::Object>& objects,
                                  const std::vector<Hypothesis>& hypotheses) {
  std::vector<std::string> paths;
  auto object = objects.begin();
  for (const Hypothesis& hypothesis : hypotheses) {
    paths.push_back(hypothesis.mirrored ? paths.back() : (object++)->map.string());
  }
  return paths;
}

/// The lattice that the flags and the scene give, and what they leave to the maps and the touches.
struct WantedLattice {
  PoseLattice lattice;
  std::optional<BinWidth> bin_width;  ///< as RecognitionTask has it
  bool auto_pivot = false;
};

std::optional<std::array<int, 3>> counts_of(const RecognitionFlags& flags, const Scene& scene) {
  if (flags.bins.empty()) {
    return scene.bins;
  }
  return flags.bins == "auto" || flags.bins == "fine"
             ? std::nullopt
             : std::optional(parse_bins("--bins", flags.bins));
}

/// What --bins auto or fine asks for, where one of them is given.
std::optional<BinWidth> bin_width_of(const RecognitionFlags& flags, const Scene& scene) {
  if (flags.bins.empty() ? scene.fine_bins : flags.bins == "fine") {
    return BinWidth::fine;
  }
  const bool is_auto = flags.bins.empty() ? scene.auto_bins : flags.bins == "auto";
  return is_auto ? std::optional(BinWidth::automatic) : std::nullopt;
}

/// Where neither counts nor any part of a region is given, all of the lattice follows from the maps
/// and the array, about the first touch in contact.
WantedLattice automatic_lattice(const RecognitionFlags& flags, std::optional<BinWidth> bin_width,
                                std::span<const Hypothesis> hypotheses, double reach_mm) {
  // As many times the bins that the objects themselves need.
  constexpr double much = 2.0;
  const TouchRegion region = touch_region(hypotheses, reach_mm);
  if (region.excess > much) {
    flags.tell(fmt::format(
        "the objects lie far apart in the frames of their maps; the bins cover {:.0f} times the "
        "area that the objects need. Learn each object near its frame's origin, or give --x-mm "
        "and --y-mm",
        region.excess));
  }
  return {region.lattice, bin_width.value_or(BinWidth::automatic), true};
}

WantedLattice lattice_of(const RecognitionFlags& flags, const Scene& scene,
                         std::span<const Hypothesis> hypotheses, double reach_mm) {
  const std::optional<BinWidth> bin_width = bin_width_of(flags, scene);
  if (infers_region(flags, scene)) {
    return automatic_lattice(flags, bin_width, hypotheses, reach_mm);
  }
  return {given_lattice(flags, scene), bin_width, has_auto_pivot(flags, scene)};
}

}  // namespace

void tell_on_stderr(const std::string& sentence) {
  fmt::print(stderr, "palpate: {}\n", in_flags(sentence));
}

bool infers_region(const RecognitionFlags& flags, const Scene& scene) {
  const bool has_range = !flags.x_mm.empty() || !flags.y_mm.empty() || !flags.theta_deg.empty() ||
                         scene.region.x_mm || scene.region.y_mm || scene.region.theta_deg;
  const bool has_pivot = flags.pivot_mm.empty() ? !scene.region.auto_pivot && scene.region.pivot_mm
                                                : flags.pivot_mm != "auto";
  const bool has_counts =
      flags.bins.empty() ? scene.bins.has_value() : flags.bins != "auto" && flags.bins != "fine";
  return !has_range && !has_pivot && !has_counts;
}

bool has_auto_pivot(const RecognitionFlags& flags, const Scene& scene) {
  return flags.pivot_mm.empty() ? scene.region.auto_pivot : flags.pivot_mm == "auto";
}

PoseLattice given_lattice(const RecognitionFlags& flags, const Scene& scene) {
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
      refuse_flag(flag, given, "give numbers within +-{:g}", farthest_mm / unit);
    }
  };
  range("--x-mm", flags.x_mm, scene.region.x_mm, lattice.x_mm, 1.0);
  range("--y-mm", flags.y_mm, scene.region.y_mm, lattice.y_mm, 1.0);
  range("--theta-deg", flags.theta_deg, scene.region.theta_deg, lattice.theta_rad, radians(1.0));
  if (lattice.exceeds_circle()) {
    refuse_flag("--theta-deg", flags.theta_deg,
                "wider than the full circle, poses would count twice; give a range of at most 360 "
                "degrees");
  }
  if (const std::optional<std::array<int, 3>> counts = counts_of(flags, scene)) {
    lattice.x_mm.count = (*counts)[0];
    lattice.y_mm.count = (*counts)[1];
    lattice.theta_rad.count = (*counts)[2];
  }
  if (!has_auto_pivot(flags, scene)) {
    const std::optional<glm::dvec2> pivot_mm =
        flags.pivot_mm.empty() ? scene.region.pivot_mm
                               : std::optional(parse_point("--pivot-mm", flags.pivot_mm));
    lattice.pivot_mm = pivot_mm.value_or(lattice.pivot_mm);
  }
  if (!(std::abs(lattice.pivot_mm.x) <= farthest_mm &&
        std::abs(lattice.pivot_mm.y) <= farthest_mm)) {
    refuse_flag("--pivot-mm", fmt::format("{},{}", lattice.pivot_mm.x, lattice.pivot_mm.y),
                "give numbers within +-{:g}", farthest_mm);
  }
  return lattice.collapse_fixed();
}

Scene scene_of(const RecognitionFlags& flags) {
  return flags.scene.empty() ? Scene{} : read_scene(flags.scene);
}

void replace_array(const Scene& scene, const std::string& scene_file, const std::string& source,
                   std::size_t elements, std::vector<glm::dvec2>& elements_mm) {
  if (!scene.array_mm) {
    return;
  }
  if (elements != scene.array_mm->size()) {
    refuse(
        source,
        "pressure: {} elements, but array of {} has {}; use its own array by leaving the key out",
        elements, scene_file, scene.array_mm->size());
  }
  elements_mm = *scene.array_mm;
}

RecognitionTask task_of(const RecognitionFlags& flags, const Scene& scene,
                        const std::string& pressure_unit, const std::string& source,
                        double reach_mm, const HistogramNeed& need) {
  const FilterWish wish = filter_wish(flags, scene);
  const std::optional<LearnedSensor> sensor = sensor_model_of(flags, scene, pressure_unit, source);
  HistogramOptions histogram;
  ContactModel& contact = histogram.contact;
  const auto rules = contact_rules(flags, scene, sensor, pressure_unit, source);
  const std::vector<Scene::Object> objects = objects_of(flags, scene);
  std::vector<Hypothesis> hypotheses = hypotheses_of(flags, objects);
  if (!sensor || !sensor->table) {
    contact.prior = prior_of(objects, hypotheses, flags.prior ? flags.prior : scene.prior);
  }
  add_mirror_images(hypotheses);
  if (sensor) {
    apply(*sensor, hypotheses, contact);
    const bool exact =
        wish.kind == FilterWish::Kind::bounded || wish.kind == FilterWish::Kind::particles;
    histogram.touch_sd = exact ? DisplacementSd{} : sensor->touch_sd;
  }
  std::tie(contact.classifier, contact.gamma) = rules;
  const WantedLattice wanted = lattice_of(flags, scene, hypotheses, reach_mm);
  histogram.lattice = wanted.lattice;
  const ChosenFilter filter = choose_filter(wish, flags, scene, need, hypotheses, histogram);
  if (!wanted.bin_width) {
    require_within_region(flags.uncertainty, scene, flags.scene, wanted.lattice);
  }
  RecognitionTask task(std::move(hypotheses), filter.options);
  task.map_paths = paths_of(objects, task.hypotheses);
  if (sensor) {
    task.temperature = sensor->temperature;
    task.temperature_growth = sensor->temperature_growth;
    task.learned_bins = sensor->bins;
    task.features = sensor->features;
    task.familiarity = sensor->familiarity;
    task.fit_scale = sensor->fit_scale.value_or(FitScale{});
  }
  task.bin_width = wanted.bin_width;
  task.auto_filter = filter.automatic;
  task.filter_asked_for_by = filter.asked_for_by;
  task.auto_pivot = wanted.auto_pivot;
  return task;
}

std::string device_of(const RecognitionFlags& flags, const Scene& scene) {
  return flags.device.empty() ? scene.device.value_or("") : flags.device;
}

Device open_device(const RecognitionFlags& flags, const Scene& scene) {
  return Device::open(device_of(flags, scene));
}

std::vector<std::string> settle_task(const RecognitionFlags& flags, const Scene& scene,
                                     const Device& device, RecognitionTask& task) {
  const bool fine = task.bin_width == BinWidth::fine;
  const std::optional<CoarsenedBins> bins = settle_bins(device, task);
  settle_filter(task);
  settle_evidence(task);
  require_within_region(flags.uncertainty, scene, flags.scene, task.lattice());
  std::vector<std::string> sentences;
  if (bins) {
    sentences.push_back(
        fmt::format("--bins {}: steps of {:.2f} mm, wider than the maps resolve, keep to {} bins "
                    "in all; narrow the region, or give --bins",
                    fine ? "fine" : "auto", bins->step_mm, bins->most_bins));
  }
  if (const std::string wider = wider_bins_sentence(task); !wider.empty()) {
    sentences.push_back(wider);
  }
  return sentences;
}

Recogniser open_recogniser(const RecognitionFlags& flags, const Scene& scene, Device& device,
                           RecognitionTask& task) {
  const std::vector<std::string> sentences = settle_task(flags, scene, device, task);
  Recogniser recogniser =
      open_filter(device, task);  // first: bins that do not fit deserve only their refusal
  std::ranges::for_each(sentences, flags.tell);
  return recogniser;
}

void add_recognition_files(const RecognitionFlags& flags, const Scene& scene,
                           const RecognitionTask& task, CommandFiles& files) {
  if (!flags.scene.empty()) {
    files.reads("--scene", flags.scene);
  }
  if (scene.array_file) {
    files.reads("--scene", *scene.array_file);
  }
  if (const std::string sensor_model = sensor_model_file(flags, scene); !sensor_model.empty()) {
    files.reads(flags.sensor_model.empty() ? "--scene" : "--sensor-model", sensor_model);
  }
  for (const std::string& map : task.map_paths) {
    files.reads(flags.maps.empty() ? "--scene" : "--maps", map);
  }
}

}  // namespace palpate::cli
