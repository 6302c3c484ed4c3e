#include "recognition/resolve.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "estimation/displacement_check.hpp"
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

std::vector<Hypothesis> hypotheses_of(const Request& request,
                                      const std::vector<Scene::Object>& objects) {
  std::vector<Hypothesis> hypotheses;
  for (const GivenMap& given : request.given_maps) {
    hypotheses.push_back(given.hypothesis);
  }
  if (!hypotheses.empty()) {
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

/// Brings maps of unlike priors to the one that all of their touches together tell.
void bring_to_one_prior(const Circumstances& of, const std::vector<Scene::Object>& objects,
                        std::vector<Hypothesis>& hypotheses, std::vector<std::string>& remarks) {
  const std::optional<std::size_t> other = differing_prior(hypotheses);
  if (!other) {
    return;
  }
  std::vector<OccupancyGrid> maps;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    maps.push_back(hypotheses[i].map);
    if (!maps.back().source && !maps.back().drawn) {
      refuse(
          objects[*other].map,
          "prior {} differs from {} of {}, and {} holds no touches to build it from again; build "
          "the maps anew, or say which prior to use with `prior`",
          hypotheses[*other].map.prior, maps.front().prior, objects.front().map.string(),
          objects[i].map.string());
    }
  }
  Device& device = of.device();
  const double prior = pooled_prior(device, maps);
  for (Hypothesis& hypothesis : hypotheses) {
    hypothesis.map = with_prior(device, hypothesis.map, prior);
  }
  remarks.push_back(fmt::format(
      "the maps' priors differ, {:.3g} of {} and {:.3g} of {}: all were built again with {:.3g}, "
      "which their touches tell together",
      maps.front().prior, printable(maps.front().label), maps[*other].prior,
      printable(maps[*other].label), prior));
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

ActWhere act_where(const Request& request) {
  ActWhere act;
  act.below_mm = request.act_below_mm.value_or(act.below_mm);
  act.above = request.act_above.value_or(act.above);
  return act;
}

/// The model of the maps' folder, unless it does not go with what is asked or touched.
std::optional<SensorFromFile> usual_sensor(const Request& request, const Circumstances& of,
                                           std::span<const Hypothesis> hypotheses,
                                           std::vector<std::string>& remarks) {
  std::optional<SensorFromFile> usual = folder_sensor(hypotheses, remarks);
  if (!usual) {
    return {};
  }
  const std::string& file = usual->file;
  const LearnedSensor& sensor = usual->sensor;
  const auto left_out = [&](const std::string& why) {
    remarks.push_back(fmt::format("{} is left out: {}; `sensor-model none` says so", file, why));
    return std::nullopt;
  };
  if (sensor.pressure_unit != of.pressure_unit) {
    return left_out(fmt::format("it is for pressures in {}, and those of {} are in {}",
                                sensor.pressure_unit, of.source, of.pressure_unit));
  }
  for (const auto& [option, given] :
       {std::pair{"gamma", request.gamma}, std::pair{"prior", request.prior}}) {
    if (given) {
      return left_out(fmt::format("`{}` is for Eq. 7", option));
    }
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

std::optional<SensorFromFile> sensor_of(const Request& request, const Circumstances& of,
                                        std::span<const Hypothesis> hypotheses,
                                        std::vector<std::string>& remarks) {
  const std::string& file = request.sensor_model;
  if (file == no_sensor_model) {
    return {};
  }
  if (file.empty()) {
    return usual_sensor(request, of, hypotheses, remarks);
  }
  LearnedSensor sensor = read_sensor_model(file);
  if (sensor.pressure_unit != of.pressure_unit) {
    refuse(file, "pressure_unit = {}, but {} has pressures in {}; calibrate from recordings in {}",
           sensor.pressure_unit, of.source, of.pressure_unit, of.pressure_unit);
  }
  for (const auto& [option, given] :
       {std::pair{"gamma", request.gamma}, std::pair{"prior", request.prior}}) {
    if (sensor.table && given) {
      refuse_given(request, option, "the table of {} takes its place; leave it out", file);
    }
  }
  return SensorFromFile{file, std::move(sensor)};
}

/// The classifier of Eq. 3 and gamma of Eq. 7: the request overrides what the sensor model learned.
std::pair<ContactClassifier, double> contact_rules(const Request& request, const Circumstances& of,
                                                   const LearnedSensor* sensor) {
  std::optional<double> threshold = request.threshold;
  std::optional<double> ratio = request.ratio;
  if (sensor != nullptr) {
    threshold = threshold.value_or(sensor->classifier.threshold);
    ratio = ratio.value_or(sensor->classifier.ratio);
  }
  const double gamma = request.gamma.value_or(sensor != nullptr ? sensor->gamma : usual_gamma);
  return {make_classifier(of.pressure_unit, of.source, threshold, ratio), gamma};
}

/// Where neither counts nor any part of a region are given, all of the lattice follows from the
/// maps and the array, about the first touch in contact.
PoseLattice automatic_lattice(std::span<const Hypothesis> hypotheses, double reach_mm,
                              std::vector<std::string>& remarks) {
  // As many times the bins that the objects themselves need.
  constexpr double much = 2.0;
  const TouchRegion region = touch_region(hypotheses, reach_mm);
  if (region.excess > much) {
    remarks.push_back(fmt::format(
        "the objects lie far apart in the frames of their maps; the bins cover {:.0f} times the "
        "area that the objects need. Learn each object near its frame's origin, or give `x-mm` "
        "and `y-mm`",
        region.excess));
  }
  return region.lattice;
}

std::optional<BinWidth> bin_width_of(const Request& request) {
  if (const auto* width = request.bins ? std::get_if<BinWidth>(&*request.bins) : nullptr) {
    return *width;
  }
  return infers_region(request) ? std::optional(BinWidth::automatic) : std::nullopt;
}

PoseLattice with_counts(PoseLattice lattice, const std::array<int, 3>& counts) {
  lattice.x_mm.count = counts[0];
  lattice.y_mm.count = counts[1];
  lattice.theta_rad.count = counts[2];
  return lattice;
}

/// The filter on the bins that are used: those settled before, chosen, or given.
FilterOptions settled_filter(const Request& request, const Circumstances& of, ChosenFilter filter,
                             std::span<const Hypothesis> hypotheses,
                             const std::optional<BinWidth>& width,
                             std::vector<std::string>& remarks) {
  if (of.counts) {
    filter.options =
        with_lattice(filter.options, with_counts(lattice_of(filter.options), *of.counts));
  } else if (width) {
    const auto [bins, most] = chosen_bins(of.device, hypotheses, filter, *width);
    filter.options = with_lattice(filter.options, bins.lattice);
    if (bins.coarsened) {
      remarks.push_back(fmt::format(
          "`bins {}`: steps of {:.2f} mm, wider than the maps resolve, keep to {} bins in all; "
          "narrow the region, or give `bins`",
          *width == BinWidth::fine ? "fine" : "auto", bins.step_mm, most));
    }
  }
  require_within_region(request, lattice_of(filter.options));
  return filter.automatic ? filter_for_bins(hypotheses, filter.options,
                                            of.need.waited_for ? 0 : most_histogram_bins)
                          : filter.options;
}

}  // namespace

RecognitionTask resolve(const Request& request, const Circumstances& of) {
  require_sound(request);
  const FilterWish wish = filter_wish(request);
  const std::vector<Scene::Object> objects = objects_of(request);
  std::vector<Hypothesis> hypotheses = hypotheses_of(request, objects);
  std::vector<std::string> remarks;
  const std::optional<SensorFromFile> learned = sensor_of(request, of, hypotheses, remarks);
  const LearnedSensor* sensor = learned ? &learned->sensor : nullptr;
  HistogramOptions histogram;
  ContactModel& contact = histogram.contact;
  const auto [classifier, gamma] = contact_rules(request, of, sensor);
  if (sensor == nullptr || !sensor->table) {
    contact.prior = request.prior;
    if (!contact.prior) {
      bring_to_one_prior(of, objects, hypotheses, remarks);
    }
  }
  add_mirror_images(hypotheses);
  if (sensor != nullptr) {
    apply(*sensor, hypotheses, contact);
    // Particles take touches to be exact.
    histogram.touch_sd = wish.kind == FilterKind::particles ? DisplacementSd{} : sensor->touch_sd;
  }
  contact.classifier = classifier;
  contact.gamma = gamma;
  const bool inferred = infers_region(request);
  histogram.lattice =
      inferred ? automatic_lattice(hypotheses, of.reach_mm, remarks) : given_lattice(request);
  const std::optional<BinWidth> bin_width = bin_width_of(request);
  CallerNeed need = of.need;
  // An object between such bins fits none of them, and would be taken for a stranger. Where
  // elements are so far from independent, the tempered evidence leaves "(none)" its prior.
  constexpr double far_wider = 8.0;
  constexpr double far_from_independent = 5.0;
  const bool auto_pivot = inferred || has_auto_pivot(request);
  const std::optional<double> near_mm = auto_pivot ? std::optional(of.reach_mm) : std::nullopt;
  const bool far_too_wide =
      !bin_width && !resolves(histogram.lattice, hypotheses, far_wider, near_mm);
  const bool without_none = far_too_wide && !request.none && !need.learned_only;
  need.learned_only |=
      far_too_wide || (sensor != nullptr && sensor->temperature > far_from_independent);
  const ChosenFilter filter = choose_filter(wish, request, need, hypotheses, histogram);
  const FilterOptions settled = settled_filter(request, of, filter, hypotheses, bin_width, remarks);
  const bool by_bounds_at_rest =
      wish.kind == FilterKind::bounded ||
      (wish.kind == FilterKind::automatic &&
       bins_in_all(hypotheses.size(), lattice_of(settled)) > most_histogram_bins);
  if (by_bounds_at_rest && !traits_of(settled).slip_sd.none()) {
    remarks.emplace_back(
        "objects that slip are followed by the histogram, over every bin; `filter histogram` says "
        "so");
  }
  const bool to_the_end = request.tolerance || request.evidence_nats;  // what was asked for holds
  RecognitionTask task(std::move(hypotheses),
                       sensor != nullptr ? with_evidence(settled, *sensor, to_the_end) : settled);
  task.map_paths = paths_of(objects, task.hypotheses);
  if (sensor != nullptr) {
    task.sensor_model = learned->file;
    task.temperature = sensor->temperature;
    task.temperature_growth = sensor->temperature_growth;
    task.learned_bins = sensor->bins;
    task.features = sensor->features;
    task.fit_scale = sensor->fit_scale.value_or(FitScale{});
    task.pose_scale = sensor->pose_scale.value_or(PoseScale{});
  } else {
    const auto [fit, pose] = scales_of_maps(task, near_mm);
    task.fit_scale = fit;
    task.pose_scale = pose;
  }
  // By Eq. 7 with "(none)" left out all touches multiply, as in the paper; and where the object
  // slips, a touch of the same place tells where it went.
  const double* none = request.none ? std::get_if<double>(&*request.none) : nullptr;
  const bool as_in_the_paper = sensor == nullptr && none != nullptr && *none == 0.0;
  task.by_place = !as_in_the_paper && task.slip_sd().none();
  task.bin_width = bin_width;
  task.auto_filter = filter.automatic;
  task.filter_asked_for_by = filter.asked_for_by;
  task.auto_pivot = auto_pivot;
  if (!request.tolerance) {
    // The belief after a first touch is wide, and takes twice as long to find within 1e-6.
    task.trace_tolerance = 1e-4;
    task.drawn_tolerance = 1e-3;  // half a pixel of a picture's curve
  }
  task.act = act_where(request);
  for (std::string words :
       {wider_bins_sentence(task), far_pivot_sentence(task, of.reach_mm, without_none)}) {
    if (!words.empty()) {
      remarks.push_back(std::move(words));
    }
  }
  task.remarks = std::move(remarks);
  return task;
}

bool uses_device(const RecognitionTask& task) { return !traits_of(task.filter).certificate; }

Recogniser open_recogniser(Device* device, const RecognitionTask& task,
                           const FilterResources& search) {
  if (!uses_device(task)) {
    return Recogniser(task, search);
  }
  try {
    return {*device, task};
  } catch (const Error& error) {
    // A resolved task is sound: only the bins' memory can be refused.
    if (error.fault() == Fault::input && traits_of(task.filter).every_bin &&
        !task.filter_asked_for_by.empty() &&
        bounds_have_room(
            task.hypotheses,
            {.lattice = task.lattice(), .contact = task.contact(), .touch_sd = task.touch_sd()})) {
      throw Error(Fault::input,
                  fmt::format("{}, or leave out {}: `filter bounded` needs no device memory",
                              error.what(), task.filter_asked_for_by));
    }
    throw;
  }
}

std::string unresolved_words(const RecognitionTask& task, const PoseLattice& lattice,
                             std::span<const Pose> T_robot_sensor) {
  std::optional<std::string> fault = unresolved_by_steps(task.touch_sd(), lattice, "touch-sd");
  if (!fault) {
    fault = unresolved_by_steps(task.slip_sd(), lattice, "slip-sd");
  }
  for (const Pose& pose : T_robot_sensor) {
    if (!fault) {
      fault = unresolved_at(pose, task.touch_sd(), lattice, "touch-sd");
    }
  }
  return fault.value_or("");
}

std::string unresolved_words(const RecognitionTask& task, const PoseLattice& lattice,
                             std::span<const Touch> touches) {
  std::vector<Pose> T_robot_sensor;
  for (const Touch& touch : touches) {
    T_robot_sensor.push_back(touch.T_robot_sensor);
  }
  return unresolved_words(task, lattice, T_robot_sensor);
}

}  // namespace palpate
