#include "recognition/resolve.hpp"

#include <algorithm>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "io/file_identity.hpp"
#include "io/input_file.hpp"
#include "model/printable.hpp"
#include "options/option.hpp"
#include "options/refused_option.hpp"
#include "palpate/files.hpp"
#include "palpate/map_builder.hpp"
#include "recognition/filter_choice.hpp"
#include "recognition/folder_sensor.hpp"
#include "recognition/recordings.hpp"
#include "recognition/scales_of_maps.hpp"

namespace palpate {

namespace {

/// What resolve() is given, and the sentences that it has for the user.
struct Asked {
  const Request& request;
  const Circumstances& of;
  const DeviceSource& device;
  std::vector<std::string> remarks = {};
};

// Each step below is a function of those before it.

// 1. The objects.

struct Objects {
  std::vector<Scene::Object> named;
  std::vector<Hypothesis> hypotheses;  ///< [object], with what the scene says of them
};

Objects read_objects(const Request& request) {
  Objects objects{objects_of(request), {}};
  for (const GivenMap& given : request.given_maps) {
    objects.hypotheses.push_back(given.hypothesis);
  }
  if (!objects.hypotheses.empty()) {
    return objects;
  }
  std::set<std::optional<FileIdentity>> seen;
  for (const Scene::Object& object : objects.named) {
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
    objects.hypotheses.push_back({std::move(map), object.weight});
  }
  return objects;
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

// 2. The sensor: what was learned about it, and the objects as its readings are compared with them.

/// The first option that only Eq. 7 reads; "" where none is given.
std::string_view option_of_eq7(const Request& request) {
  return first_given(request, {"gamma", "prior"});
}

/// The model of the maps' folder, unless it does not go with what is asked or touched.
std::optional<SensorFromFile> usual_sensor(Asked& asked, std::span<const Hypothesis> hypotheses) {
  const Request& request = asked.request;
  const Circumstances& of = asked.of;
  std::optional<SensorFromFile> usual = folder_sensor(hypotheses, asked.remarks);
  if (!usual) {
    return {};
  }
  const std::string& file = usual->file;
  const LearnedSensor& sensor = usual->sensor;
  const auto left_out = [&](const std::string& why) {
    asked.remarks.push_back(
        fmt::format("{} is left out: {}; `sensor-model none` says so", file, why));
    return std::nullopt;
  };
  if (sensor.pressure_unit != of.pressure_unit) {
    return left_out(fmt::format("it is for pressures in {}, and those of {} are in {}",
                                sensor.pressure_unit, of.source, of.pressure_unit));
  }
  if (const std::string_view option = option_of_eq7(request); !option.empty()) {
    return left_out(fmt::format("`{}` is for Eq. 7", option));
  }
  for (const auto& [option, given, learned] :
       {std::tuple{"threshold", request.threshold, sensor.classifier.threshold},
        std::tuple{"ratio", request.ratio, sensor.classifier.ratio}}) {
    if (given && *given != learned) {
      return left_out(
          fmt::format("its {} is {:.4g}, not `{} {:g}`", option, learned, option, *given));
    }
  }
  return usual;
}

/// None by Eq. 7.
std::optional<SensorFromFile> sensor_of(Asked& asked, std::span<const Hypothesis> hypotheses) {
  const Request& request = asked.request;
  const Circumstances& of = asked.of;
  const std::string& file = request.sensor_model;
  if (file == no_sensor_model) {
    return {};
  }
  if (file.empty()) {
    return usual_sensor(asked, hypotheses);
  }
  LearnedSensor sensor = read_sensor_model(file);
  if (sensor.pressure_unit != of.pressure_unit) {
    refuse(file, "pressure_unit = {}, but {} has pressures in {}; calibrate from recordings in {}",
           sensor.pressure_unit, of.source, of.pressure_unit, of.pressure_unit);
  }
  if (const std::string_view option = option_of_eq7(request); sensor.table && !option.empty()) {
    refuse_given(request, option, "the table of {} takes its place; leave it out", file);
  }
  return SensorFromFile{file, std::move(sensor)};
}

/// The hypotheses, maps of unlike priors brought to the one that all of their touches together
/// tell.
std::vector<Hypothesis> with_one_prior(Asked& asked, const std::vector<Scene::Object>& named,
                                       std::vector<Hypothesis> hypotheses) {
  const std::optional<std::size_t> other = differing_prior(hypotheses);
  if (!other) {
    return hypotheses;
  }
  std::vector<OccupancyGrid> maps;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    maps.push_back(hypotheses[i].map);
    if (!maps.back().source && !maps.back().drawn) {
      refuse(
          named[*other].map,
          "prior {} differs from {} of {}, and {} holds no touches to build it from again; build "
          "the maps anew, or say which prior to use with `prior`",
          hypotheses[*other].map.prior, maps.front().prior, named.front().map.string(),
          named[i].map.string());
    }
  }
  Device& device = asked.device();
  const double prior = pooled_prior(device, maps);
  for (Hypothesis& hypothesis : hypotheses) {
    hypothesis.map = with_prior(device, hypothesis.map, prior);
  }
  asked.remarks.push_back(fmt::format(
      "the maps' priors differ, {:.3g} of {} and {:.3g} of {}: all were built again with {:.3g}, "
      "which their touches tell together",
      maps.front().prior, printable(maps.front().label), maps[*other].prior,
      printable(maps[*other].label), prior));
  return hypotheses;
}

/// What touches are compared with, and by which model.
struct Comparison {
  std::vector<Hypothesis> hypotheses;  ///< mirror images stand after their objects
  ContactModel contact;
};

/// What is asked overrides what was learned.
/// @param sensor null by Eq. 7
Comparison comparison_by(const LearnedSensor* sensor, Asked& asked,
                         const std::vector<Scene::Object>& named,
                         std::vector<Hypothesis> hypotheses) {
  const Request& request = asked.request;
  std::optional<double> threshold = request.threshold;
  std::optional<double> ratio = request.ratio;
  if (sensor != nullptr) {
    threshold = threshold.value_or(sensor->classifier.threshold);
    ratio = ratio.value_or(sensor->classifier.ratio);
  }
  const ContactClassifier classifier =
      make_classifier(asked.of.pressure_unit, asked.of.source, threshold, ratio);
  Comparison by{std::move(hypotheses), {}};
  if (sensor == nullptr || !sensor->table) {
    by.contact.prior = request.prior;
    if (!request.prior) {
      by.hypotheses = with_one_prior(asked, named, std::move(by.hypotheses));
    }
  }
  add_mirror_images(by.hypotheses);
  if (sensor != nullptr) {
    apply(*sensor, by.hypotheses, by.contact);
  }
  by.contact.classifier = classifier;
  by.contact.gamma = request.gamma.value_or(sensor != nullptr ? sensor->gamma : usual_gamma);
  return by;
}

// 3. The region.

struct Region {
  PoseLattice lattice;  ///< with the counts that are given
  /// By which counts are chosen; none where they are given.
  std::optional<BinWidth> bin_width = {};
  bool auto_pivot = false;
  std::optional<double> near_mm = {};  ///< see resolves()
};

/// Where neither counts nor any part of a region are given, all of the lattice follows from the
/// maps and the array, about the first touch in contact.
Region region_of(Asked& asked, std::span<const Hypothesis> hypotheses) {
  // As many times the bins that the objects themselves need.
  constexpr double much = 2.0;
  const Request& request = asked.request;
  const bool inferred = infers_region(request);
  Region region;
  if (inferred) {
    const TouchRegion touched = touch_region(hypotheses, asked.of.reach_mm);
    if (touched.excess > much) {
      asked.remarks.push_back(fmt::format(
          "the objects lie far apart in the frames of their maps; the bins cover {:.0f} times the "
          "area that the objects need. Learn each object near its frame's origin, or give `x-mm` "
          "and `y-mm`",
          touched.excess));
    }
    region.lattice = touched.lattice;
    region.bin_width = BinWidth::automatic;
  } else {
    region.lattice = given_lattice(request);
  }
  if (const auto* width = request.bins ? std::get_if<BinWidth>(&*request.bins) : nullptr) {
    region.bin_width = *width;
  }
  region.auto_pivot = inferred || has_auto_pivot(request);
  if (region.auto_pivot) {
    region.near_mm = asked.of.reach_mm;
  }
  return region;
}

// 4. "(none)" beside the objects.

struct NoneOfThese {
  std::optional<double> weight = {};  ///< none: it is left out
  bool for_its_bins = false;          ///< it is left out as the bins are too wide to tell it
};

NoneOfThese none_of_these(const Request& request, const LearnedSensor* sensor, const Region& region,
                          std::span<const Hypothesis> hypotheses) {
  const NoneWeight wish = request.none.value_or(Automatic{});
  if (const auto* weight = std::get_if<double>(&wish)) {
    return {.weight = *weight > 0.0 ? std::optional(*weight) : std::nullopt};
  }
  if (!request.none) {
    // An object between such bins fits none of them, and would be taken for a stranger. Where
    // elements are so far from independent, the tempered evidence leaves "(none)" its prior.
    constexpr double far_wider = 8.0;
    constexpr double far_from_independent = 5.0;
    const bool far_too_wide =
        !region.bin_width && !resolves(region.lattice, hypotheses, far_wider, region.near_mm);
    if (far_too_wide || (sensor != nullptr && sensor->temperature > far_from_independent)) {
      return {.for_its_bins = far_too_wide};
    }
  }
  constexpr double odds = 1.0 / 9.0;  // against all objects together: one in ten
  double sum = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    sum += hypothesis.weight;
  }
  return {.weight = odds * sum};
}

// 5. The filter.

/// The filter on the bins that are used: those settled before, chosen, or given.
/// @param histogram what was settled by the steps before
ChosenFilter filter_on_bins(Asked& asked, const FilterWish& wish, const HistogramOptions& histogram,
                            const std::optional<BinWidth>& width,
                            std::span<const Hypothesis> hypotheses) {
  const Request& request = asked.request;
  ChosenFilter filter = choose_filter(wish, request, asked.of.every_bin_for, histogram);
  if (asked.of.counts) {
    PoseLattice lattice = histogram.lattice;
    lattice.x_mm.count = (*asked.of.counts)[0];
    lattice.y_mm.count = (*asked.of.counts)[1];
    lattice.theta_rad.count = (*asked.of.counts)[2];
    filter.options = with_lattice(filter.options, lattice);
  } else if (width) {
    const auto [bins, most] = chosen_bins(asked.device, hypotheses, filter, *width);
    filter.options = with_lattice(filter.options, bins.lattice);
    if (bins.coarsened) {
      asked.remarks.push_back(fmt::format(
          "`bins {}`: steps of {:.2f} mm, wider than the maps resolve, keep to {} bins in all; "
          "narrow the region, or give `bins`",
          *width == BinWidth::fine ? "fine" : "auto", bins.step_mm, most));
    }
  }
  const PoseLattice& lattice = lattice_of(filter.options);
  require_within_region(request, lattice);
  const bool by_bounds_at_rest = wish.kind == FilterKind::bounded ||
                                 (wish.kind == FilterKind::automatic &&
                                  bins_in_all(hypotheses.size(), lattice) > most_histogram_bins);
  if (by_bounds_at_rest && !traits_of(filter.options).slip_sd.none()) {
    asked.remarks.emplace_back(
        "objects that slip are followed by the histogram, over every bin; `filter histogram` says "
        "so");
  }
  if (filter.automatic) {
    filter.options =
        filter_for_bins(hypotheses, filter.options, asked.of.waited_for ? 0 : most_histogram_bins);
  }
  return filter;
}

/// By Eq. 7 with "(none)" left out all touches multiply, as in the paper; and where the object
/// slips, a touch of the same place tells where it went.
bool counts_by_place(const Request& request, const RecognitionTask& task) {
  const double* none = request.none ? std::get_if<double>(&*request.none) : nullptr;
  const bool as_in_the_paper = task.sensor_model.empty() && none != nullptr && *none == 0.0;
  return !as_in_the_paper && task.slip_sd().none();
}

}  // namespace

RecognitionTask resolve(const Request& request, const Circumstances& of,
                        const DeviceSource& device) {
  require_sound(request);
  const FilterWish wish = filter_wish(request);
  Asked asked{request, of, device};
  Objects objects = read_objects(request);
  const std::optional<SensorFromFile> learned = sensor_of(asked, objects.hypotheses);
  const LearnedSensor* sensor = learned ? &learned->sensor : nullptr;
  Comparison by = comparison_by(sensor, asked, objects.named, std::move(objects.hypotheses));
  const Region region = region_of(asked, by.hypotheses);
  const NoneOfThese none = none_of_these(request, sensor, region, by.hypotheses);
  ChosenFilter filter =
      filter_on_bins(asked, wish,
                     {.lattice = region.lattice,
                      .contact = by.contact,
                      .none_weight = none.weight,
                      .touch_sd = sensor != nullptr ? sensor->touch_sd : DisplacementSd{}},
                     region.bin_width, by.hypotheses);
  if (sensor != nullptr) {
    const bool honour_tolerance =
        request.tolerance || request.evidence_nats;  // what was asked for holds
    filter.options = with_evidence(filter.options, *sensor, honour_tolerance);
  }

  RecognitionTask task(std::move(by.hypotheses), std::move(filter.options));
  task.map_paths = paths_of(objects.named, task.hypotheses);
  task.bin_width = region.bin_width;
  task.auto_pivot = region.auto_pivot;
  task.auto_filter = filter.automatic;
  task.filter_asked_for_by = filter.asked_for_by;
  if (learned) {
    task.sensor_model = learned->file;
    task.sensor = learned->sensor;
  } else {
    const auto [fit, pose] = scales_of_maps(task, region.near_mm);
    task.sensor.fit_scale = fit;
    task.sensor.pose_scale = pose;
  }
  task.by_place = counts_by_place(request, task);
  if (!request.tolerance) {
    // The belief after a first touch is wide, and takes twice as long to find within 1e-6.
    task.trace_tolerance = 1e-4;
    task.drawn_tolerance = 1e-3;  // half a pixel of a picture's curve
  }
  task.act.below_mm = request.act_below_mm.value_or(task.act.below_mm);
  task.act.above = request.act_above.value_or(task.act.above);
  for (std::string words :
       {wider_bins_sentence(task), far_pivot_sentence(task, of.reach_mm, none.for_its_bins)}) {
    if (!words.empty()) {
      asked.remarks.push_back(std::move(words));
    }
  }
  task.remarks = std::move(asked.remarks);
  return task;
}

}  // namespace palpate
