#include "recognition/touch_sd_fit.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "model/bounding_box.hpp"
#include "palpate/error.hpp"
#include "recognition/evidence_search.hpp"
#include "recognition/recogniser.hpp"
#include "recognition/refused_option.hpp"
#include "recognition/resolve.hpp"

namespace palpate {

namespace {

constexpr double recognising_share = 0.5;  ///< of the time that the fit takes

/// An unknown's samples of object and pose with TouchSdFitOptions::start.
struct Start {
  std::vector<PoseSample> samples;
  PoseLattice region;
};

/// Gives the axes steps of 0.6 times the displacements, which samples of them need no finer.
PoseLattice coarse(PoseLattice lattice, const DisplacementSd& start) {
  constexpr double steps_per_sd = 1.0 / 0.6;
  const auto divide = [](Axis& axis, double sd) {
    axis.count =
        std::max(1, static_cast<int>(std::lround(steps_per_sd * (axis.upper - axis.lower) / sd)));
  };
  divide(lattice.x_mm, start.mm);
  divide(lattice.y_mm, start.mm);
  divide(lattice.theta_rad, start.rad);
  return lattice;
}

/// The hypotheses that bear a label, by index.
std::vector<std::size_t> bearers(const RecognitionTask& task, const std::string& label) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < task.hypotheses.size(); ++i) {
    if (label.empty() || task.hypotheses[i].map.label == label) {
      indices.push_back(i);
    }
  }
  return indices;
}

/// The contact model with the numbers of these objects only, where a table has numbers for each.
ContactModel contact_of(const ContactModel& contact, const std::vector<std::size_t>& objects) {
  ContactModel part = contact;
  if (part.table && part.table->sets() > 1) {
    const std::size_t size = part.table->levels() * part.table->nodes;
    std::vector<double> nats;
    for (const std::size_t object : objects) {
      const auto first =
          contact.table->log_likelihood.begin() + static_cast<std::ptrdiff_t>(object * size);
      nats.insert(nats.end(), first, first + static_cast<std::ptrdiff_t>(size));
    }
    part.table->log_likelihood = std::move(nats);
  }
  return part;
}

/// The task among these objects by a filter of the same kind, with displacements as the search
/// begins and bins that resolve them.
RecognitionTask part_of(const RecognitionTask& task, const std::vector<std::size_t>& objects,
                        const DisplacementSd& start) {
  const FilterTraits traits = traits_of(task.filter);
  if (!traits.bins) {
    throw Error(Fault::input, "fit of touch-sd: needs a belief in bins, which particles have not");
  }
  const HistogramOptions histogram{
      .lattice = task.bin_width ? coarse(task.lattice(), start) : task.lattice(),
      .contact = contact_of(task.contact(), objects),
      .touch_sd = start,
      .memory_limit_bytes = traits.memory_limit_bytes};
  FilterOptions filter = histogram;
  if (traits.certificate) {
    BoundedOptions bounded = bounded_instead(histogram).value();
    bounded.tolerance = traits.tolerance.value();
    filter = std::move(bounded);
  }
  std::vector<Hypothesis> hypotheses;
  for (const std::size_t object : objects) {
    hypotheses.push_back(task.hypotheses[object]);
  }
  RecognitionTask part(std::move(hypotheses), std::move(filter));
  part.auto_pivot = task.auto_pivot;
  return part;
}

/// Recognises every unknown among the objects that it may be.
std::vector<Start> recognise_all(Device* device, const RecognitionTask& task,
                                 std::span<const TouchedObject> unknowns,
                                 const TouchSdFitOptions& options,
                                 const std::function<void(double)>& progress) {
  std::map<std::string, std::vector<std::size_t>> by_label;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    by_label[unknowns[i].label].push_back(i);
  }
  std::vector<Start> starts(unknowns.size());
  std::size_t done = 0;
  for (const auto& [label, indices] : by_label) {
    const std::vector<std::size_t> objects = bearers(task, label);
    if (objects.empty()) {
      throw Error(Fault::input, fmt::format("{}: no map of {}; leave the label empty",
                                            unknowns[indices.front()].name, label));
    }
    const RecognitionTask part = part_of(task, objects, options.start);
    Recogniser recogniser = open_recogniser(device, part, options.resources);
    for (const std::size_t i : indices) {
      recogniser.reset();
      recogniser.update(unknowns[i].touches);
      starts[i] = {recogniser.sample(options.samples, options.seed + i), recogniser.lattice()};
      for (PoseSample& sample : starts[i].samples) {
        sample.object = static_cast<int>(objects[static_cast<std::size_t>(sample.object)]);
      }
      if (progress) {
        progress(recognising_share * static_cast<double>(++done) /
                 static_cast<double>(unknowns.size()));
      }
    }
  }
  return starts;
}

/// TouchSdFit::resolution.
DisplacementSd resolution_of(const RecognitionTask& task, std::span<const TouchedObject> unknowns) {
  constexpr double of_a_cell = 0.3;
  double cell_mm = task.hypotheses.front().map.cell_mm;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    cell_mm = std::min(cell_mm, hypothesis.map.cell_mm);
  }
  double reach_mm = cell_mm;
  for (const TouchedObject& unknown : unknowns) {
    for (const Touch& touch : unknown.touches) {
      reach_mm = std::max(reach_mm, array_reach_mm(touch.elements_mm));
    }
  }
  return {of_a_cell * cell_mm, of_a_cell * cell_mm / reach_mm};
}

bool in_one_place(const TouchedObject& unknown) {
  constexpr double place_mm = 1.0;
  BoundingBox box;
  for (const Touch& touch : unknown.touches) {
    box.take_in(touch.T_robot_sensor.translation_mm);
  }
  return box.diagonal() < place_mm;
}

std::vector<std::string> warnings_about(std::span<const TouchedObject> unknowns,
                                        const TouchSdFit& fit, bool ended) {
  constexpr std::size_t enough_touches = 3;
  constexpr double much = 0.3;  // relative standard error
  std::vector<std::string> warnings;
  const auto few = std::ranges::count_if(unknowns, [](const TouchedObject& unknown) {
    return unknown.touches.size() < enough_touches;
  });
  const auto still = std::ranges::count_if(unknowns, in_one_place);
  if (few > 0) {
    warnings.push_back(fmt::format(
        "{} of {} unknowns have fewer than {} touches: one pose explains two touches whatever "
        "their displacements; touch each object more often",
        few, unknowns.size(), enough_touches));
  }
  if (still == std::ssize(unknowns)) {
    warnings.emplace_back(
        "every unknown was touched in one place only, so that its pose explains what the "
        "touches have in common; touch each object in several places");
  }
  if (!ended) {
    warnings.emplace_back("the evidence has no clear maximum; give more touches");
  } else if (fit.standard_error.mm > much * fit.sd.mm ||
             fit.standard_error.rad > much * fit.sd.rad) {
    warnings.emplace_back(
        "the standard errors are large: where more unknowns do not mend that, an array of this "
        "size "
        "does not tell more");
  }
  return warnings;
}

}  // namespace

std::vector<TouchedObject> touched_objects(std::span<const Recording> recordings,
                                           std::span<const Unknown> unknowns,
                                           const RecognitionTask& task) {
  std::vector<TouchedObject> objects;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const std::string& label = recordings[i].object;
    const bool known = std::ranges::find(task.labels, label) != task.labels.end();
    objects.push_back({unknowns[i].recording, unknowns[i].touches, known ? label : ""});
  }
  return objects;
}

void require_fittable(const Request& request, const RecognitionTask& task) {
  if (!traits_of(task.filter).bins) {
    refuse_option("fit-touch-sd",
                  "particles cannot fit it; use `filter bounded` or `filter histogram`");
  }
  for (const auto& [option, given] :
       {std::pair{"budget-ms", request.budget_ms.has_value()},
        std::pair{"evidence-nats", request.evidence_nats.has_value()}}) {
    if (given) {
      refuse_option(option, "has no effect on `fit-touch-sd`; leave it out");
    }
  }
  if (!task.touch_sd().none()) {
    refuse_option(
        "fit-touch-sd",
        "finds what `touch-sd-mm` and `touch-sd-deg`, the scene's touch_sd or the sensor model "
        "say already; leave those out");
  }
  if (!task.slip_sd().none()) {
    refuse_option(
        "fit-touch-sd",
        "takes objects to rest between touches; leave out `slip-sd-mm` and `slip-sd-deg`, or "
        "the scene's slip_sd");
  }
  if (task.contact().table) {
    refuse_option("fit-touch-sd",
                  "learns a model of the sensor of its own; leave out the sensor model");
  }
  if (task.labels.back() == none_label) {
    refuse_option(
        "fit-touch-sd",
        "takes every unknown to be one of the maps' objects; leave out `none`, or the scene's "
        "none");
  }
}

TouchSdFit fit_touch_sd(Device* device, const RecognitionTask& task,
                        std::span<const TouchedObject> unknowns, const TouchSdFitOptions& options,
                        const std::function<void(double)>& progress) {
  if (unknowns.empty()) {
    throw Error(Fault::input, "fit of touch-sd: no unknowns; give at least one recording");
  }
  TouchSdFit fit{.unknowns = unknowns.size()};
  ContactModel contact = task.contact();
  contact.prior = contact.prior.value_or(task.hypotheses.front().map.prior);
  std::vector<std::vector<LivingElements>> touches(unknowns.size());
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    if (unknowns[i].touches.empty()) {
      throw Error(Fault::input, unknowns[i].name + ": no touches");
    }
    for (const Touch& touch : unknowns[i].touches) {
      touches[i].emplace_back(touch, contact);
    }
    fit.touches += unknowns[i].touches.size();
  }
  const std::vector<Start> starts = recognise_all(device, task, unknowns, options, progress);

  std::vector<SmoothOccupancy> maps;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    maps.emplace_back(hypothesis.map, contact);
  }
  ReadingModel readings(contact);
  std::vector<DisplacementPopulation> populations;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    populations.emplace_back(touches[i], maps, readings, starts[i].region, starts[i].samples,
                             options.seed + i);
  }
  fit.resolution = resolution_of(task, unknowns);
  constexpr double least_part = 3.0;
  const DisplacementSd least{fit.resolution.mm / least_part, fit.resolution.rad / least_part};
  const LargestEvidence found = find_largest_evidence(
      populations, readings, {.start = options.start, .least = least, .sweeps = options.sweeps},
      [&](double fraction) {
        if (progress) {
          progress(recognising_share + (1.0 - recognising_share) * fraction);
        }
      });
  fit.sd = found.sd;
  fit.standard_error = found.standard_error;
  fit.evidence_gain = found.gain;
  const bool none = found.gain < 0.0;  // exact poses explain the touches better
  if (none || fit.sd.mm < fit.resolution.mm) {
    fit.sd.mm = fit.standard_error.mm = 0.0;
  }
  if (none || fit.sd.rad < fit.resolution.rad) {
    fit.sd.rad = fit.standard_error.rad = 0.0;
  }
  if (fit.sd.none()) {
    fit.evidence_gain = 0.0;
  }
  fit.warnings = warnings_about(unknowns, fit, found.ended);
  return fit;
}

}  // namespace palpate
