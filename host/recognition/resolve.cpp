#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "model/printable.hpp"
#include "options/option.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "palpate/map_builder.hpp"
#include "recognition/filter_choice.hpp"
#include "recognition/recognition_job.hpp"
#include "recognition/recordings.hpp"
#include "recognition/scales.hpp"

namespace palpate {

namespace {

// resolve() is five steps, each a function of those before it.

// 1. The objects.

struct Objects {
  std::vector<Hypothesis> hypotheses;  ///< with what the scene says of them
  std::vector<std::string> files;      ///< [hypothesis] of its map
};

Objects objects_in(const Request& request) {
  Objects objects;
  for (const auto& [name, hypothesis] : request.given_maps) {
    objects.hypotheses.push_back(hypothesis);
    objects.files.push_back(name);
  }
  if (!objects.files.empty()) {
    return objects;
  }
  std::set<std::optional<FileIdentity>> seen;
  for (const Scene::Object& object : objects_of(request)) {
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
    objects.files.push_back(object.map.string());
  }
  return objects;
}

// 2. The sensor: what was learned about it, and the objects as its readings are compared with them.

/// The first option that only Eq. 7 reads; "" where none is given.
std::string_view option_of_eq7(const Request& request) {
  return first_given(request, {"gamma", "prior"});
}

/// Why the model of the maps' folder does not go with what is asked or touched; "" where it does.
std::string why_left_out(const LearnedSensor& sensor, const Request& request,
                         const Circumstances& of) {
  if (sensor.pressure_unit != of.pressure_unit) {
    return fmt::format("it is for pressures in {}, and those of {} are in {}", sensor.pressure_unit,
                       of.source, of.pressure_unit);
  }
  if (const std::string_view option = option_of_eq7(request); !option.empty()) {
    return fmt::format("`{}` is for Eq. 7", option);
  }
  for (const auto& [option, given, learned] :
       {std::tuple{"threshold", request.threshold, sensor.classifier.threshold},
        std::tuple{"ratio", request.ratio, sensor.classifier.ratio}}) {
    if (given && *given != learned) {
      return fmt::format("its {} is {:.4g}, not `{} {:g}`", option, learned, option, *given);
    }
  }
  return "";
}

/// The model of no file where touches are judged by Eq. 7.
SensorFromFile sensor_of(Asked& asked, std::span<const Hypothesis> hypotheses) {
  const Request& request = asked.request;
  const Circumstances& of = asked.of;
  if (request.sensor_model == no_sensor_model) {
    return {};
  }
  if (request.sensor_model.empty()) {
    SensorFromFile usual = folder_sensor(hypotheses, asked.remarks);
    const std::string why = usual.file.empty() ? "" : why_left_out(usual, request, of);
    if (why.empty()) {
      return usual;
    }
    asked.remarks.push_back(
        fmt::format("{} is left out: {}; `sensor-model none` says so", usual.file, why));
    return {};
  }
  SensorFromFile sensor = sensor_from(request.sensor_model);
  if (sensor.pressure_unit != of.pressure_unit) {
    refuse(sensor.file,
           "pressure_unit = {}, but {} has pressures in {}; calibrate from recordings in {}",
           sensor.pressure_unit, of.source, of.pressure_unit, of.pressure_unit);
  }
  if (const std::string_view option = option_of_eq7(request); sensor.table && !option.empty()) {
    refuse_given(request, option, "the table of {} takes its place; leave it out", sensor.file);
  }
  return sensor;
}

/// Brings maps of unlike priors to the one that all of their touches together tell.
void equalize_priors(Asked& asked, Objects& objects) {
  std::vector<Hypothesis>& hypotheses = objects.hypotheses;
  const std::optional<std::size_t> other = differing_prior(hypotheses);
  if (!other) {
    return;
  }
  std::vector<OccupancyGrid> maps;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    maps.push_back(hypotheses[i].map);
    if (!maps.back().source && !maps.back().drawn) {
      refuse(objects.files[*other],
             "prior {} differs from {} of {}, and {} holds no touches to build it from again; "
             "build the maps anew, or say which prior to use with `prior`",
             hypotheses[*other].map.prior, maps.front().prior, objects.files.front(),
             objects.files[i]);
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
}

/// The model by which touches are compared with the objects, which get what it asks of them, and
/// their mirror images. What is asked overrides what was learned.
ContactModel contact_by(const SensorFromFile& sensor, Asked& asked, Objects& objects) {
  const Request& request = asked.request;
  const ContactClassifier usual = sensor.file.empty()
                                      ? make_classifier(asked.of.pressure_unit, asked.of.source,
                                                        request.threshold, request.ratio)
                                      : sensor.classifier;
  ContactModel contact;
  if (!sensor.table) {
    contact.prior = request.prior;
    if (!request.prior) {
      equalize_priors(asked, objects);
    }
  }
  add_mirror_images(objects.hypotheses);
  for (std::size_t i = 0; i < objects.hypotheses.size(); ++i) {
    if (objects.hypotheses[i].mirrored) {  // after its object
      objects.files.insert(objects.files.begin() + static_cast<std::ptrdiff_t>(i),
                           objects.files[i - 1]);
    }
  }
  apply(sensor, objects.hypotheses, contact);
  contact.classifier.threshold = request.threshold.value_or(usual.threshold);
  contact.classifier.ratio = request.ratio.value_or(usual.ratio);
  contact.gamma = request.gamma.value_or(sensor.gamma);
  return contact;
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

NoneOfThese none_of_these(const Request& request, const LearnedSensor& sensor, const Region& region,
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
    if (far_too_wide || sensor.temperature > far_from_independent) {
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

/// By Eq. 7 with "(none)" left out all touches multiply, as in the paper; and where the object
/// slips, a touch of the same place tells where it went.
bool counts_by_place(const Request& request, const RecognitionTask& task) {
  const double* none = request.none ? std::get_if<double>(&*request.none) : nullptr;
  const bool as_in_the_paper = task.sensor.file.empty() && none != nullptr && *none == 0.0;
  return !as_in_the_paper && task.slip_sd().none();
}

// 5. The filter: choose_filter().

}  // namespace

RecognitionTask resolve(const Request& request, const Circumstances& of,
                        const DeviceSource& device) {
  require_sound(request);
  const FilterWish wish = filter_wish(request);
  Asked asked{request, of, device};
  Objects objects = objects_in(request);
  SensorFromFile sensor = sensor_of(asked, objects.hypotheses);
  const ContactModel contact = contact_by(sensor, asked, objects);
  const Region region = region_of(asked, objects.hypotheses);
  const NoneOfThese none = none_of_these(request, sensor, region, objects.hypotheses);
  ChosenFilter filter = choose_filter(asked, wish, objects.hypotheses,
                                      {.lattice = region.lattice,
                                       .contact = contact,
                                       .none_weight = none.weight,
                                       .touch_sd = sensor.touch_sd},
                                      region.bin_width);
  const bool honour_tolerance = request.tolerance || request.evidence_nats;  // what is asked holds
  RecognitionTask task(std::move(objects.hypotheses),
                       with_evidence(std::move(filter.options), sensor, honour_tolerance));
  task.map_paths = std::move(objects.files);
  task.auto_pivot = region.auto_pivot;
  task.filter_chosen_by = filter.by;
  task.sensor = std::move(sensor);
  if (task.sensor.file.empty()) {  // by Eq. 7
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
