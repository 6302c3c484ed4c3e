#include "learning/setup_judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <list>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "model/map_likelihood.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"
#include "palpate/fit.hpp"

namespace palpate {

namespace {

bool is_alive(const Touch& touch, std::size_t e) {
  return touch.valid.empty() || touch.valid[e] != 0;
}

/// Which elements live by both lists; an empty `given` says that all do.
std::vector<std::uint8_t> both(std::vector<std::uint8_t> tried,
                               std::span<const std::uint8_t> given) {
  for (std::size_t e = 0; e < given.size(); ++e) {
    tried[e] &= given[e];
  }
  return tried;
}

}  // namespace

SetupJudge::SetupJudge(Device& device, std::span<const Recording> recordings,
                       const MapOptions& options)
    : device_(device), options_(options) {
  bool all_in_contact = true;
  for (const Recording& recording : recordings) {
    touches_[recording.object];  // an object that was never in contact is missed
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const Touch touch = recording.touch(i);
      TouchEvidence evidence(touch, {.classifier = options.classifier});
      all_in_contact =
          all_in_contact &&
          std::ranges::find(evidence.readings, Reading::no_contact) == evidence.readings.end();
      if (evidence.in_contact()) {
        touches_[recording.object].push_back(
            {touch, std::move(evidence.readings), recording.path, i});
      }
    }
  }
  for (const auto& [object, given] : touches_) {
    if (given.empty()) {
      throw Error(Fault::input,
                  fmt::format("object '{}': no element is in contact in any of its touches; lower "
                              "`threshold`, or look at the array's wiring and its baseline",
                              object));
    }
    if (given.size() < 4) {
      throw Error(Fault::input,
                  fmt::format("object '{}': {} touches in contact; four or more of every object "
                              "tell its set-up",
                              object, given.size()));
    }
  }
  if (all_in_contact) {
    throw Error(Fault::input,
                "every element is in contact in every touch, which tells nothing of the set-up; "
                "raise `threshold`, or take off the array's baseline at rest");
  }
  contact_.classifier = options.classifier;
}

double SetupJudge::nats(const Setup& setup) {
  double sum = 0.0;
  try {
    visit(setup, [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
      const MapLikelihood likelihood(map, contact_);
      for (std::size_t e = 0; e < given.readings.size(); ++e) {
        sum += likelihood.at(given.readings[e], touch.T_robot_sensor * touch.elements_mm[e]);
      }
    });
  } catch (const Error& error) {
    if (error.fault() != Fault::input) {
      throw;
    }
    return -1e300;  // so far apart that no map holds them
  }
  return sum;
}

SetupFit SetupJudge::fit(const Setup& setup) {
  SetupFit result;
  visit(setup, [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
    const std::optional<Fit> fit = fit_of({&touch, 1}, {}, map, contact_);
    result.touches += fit ? 1 : 0;
    result.misfits += fit && fit->z < fits_from_z ? 1 : 0;
    const MapLikelihood likelihood(map, contact_);
    const double prior_log_odds = std::log(map.prior / (1.0 - map.prior));
    for (std::size_t e = 0; e < given.readings.size(); ++e) {
      if (is_alive(touch, e)) {
        const Reading reading = given.readings[e];
        result.told += likelihood.at(reading, touch.T_robot_sensor * touch.elements_mm[e]) -
                       likelihood.of(reading, prior_log_odds);
      }
    }
  });
  return result;
}

void SetupJudge::visit(const Setup& setup, const Take& take) {
  std::vector<ObjectTouches> halves;
  std::list<std::vector<std::uint8_t>> valid;  // of the touches
  std::vector<std::vector<const TriedTouch*>> given_halves;
  for (const auto& [object, given] : touches_) {
    for (std::size_t half = 0; half < 2; ++half) {
      halves.push_back({object, {}});
      given_halves.emplace_back();
      for (std::size_t i = half; i < given.size(); i += 2) {
        if (setup.left_out.contains(&given[i])) {
          continue;
        }
        given_halves.back().push_back(&given[i]);
        Touch touch = given[i].touch;
        touch.T_robot_sensor = {setup.mm * touch.T_robot_sensor.translation_mm,
                                setup.rad * touch.T_robot_sensor.theta_rad};
        touch.elements_mm = setup.elements_mm;
        if (!setup.valid.empty()) {
          touch.valid = valid.emplace_back(both(setup.valid, touch.valid));
        }
        halves.back().touches.push_back(touch);
      }
    }
  }
  if (!contact_.prior) {
    contact_.prior = estimate_prior(device_, halves, options_);
    options_.sensor.prior = *contact_.prior;
  }
  MapBuilder builder(device_, options_);
  for (std::size_t half = 0; half < halves.size(); ++half) {
    const std::size_t other = half ^ 1;  // of the same object
    builder.clear();
    builder.add(halves[other].touches);
    const OccupancyGrid map = builder.build(halves[half].label);
    for (std::size_t i = 0; i < halves[half].touches.size(); ++i) {
      take(*given_halves[half][i], halves[half].touches[i], map);
    }
  }
}

}  // namespace palpate
