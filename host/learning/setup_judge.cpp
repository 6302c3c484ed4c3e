#include "learning/setup_judge.hpp"

#include <cstddef>
#include <list>
#include <utility>

#include <fmt/format.h>

#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

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
  for (const Recording& recording : recordings) {
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const Touch touch = recording.touch(i);
      TouchEvidence evidence(touch, {.classifier = options.classifier});
      if (evidence.in_contact()) {
        touches_[recording.object].push_back(
            {touch, std::move(evidence.readings), recording.path, i});
      }
    }
  }
  for (const auto& [object, given] : touches_) {
    if (given.size() < 4) {
      throw Error(Fault::input,
                  fmt::format("object '{}': {} touches in contact; four or more of every object "
                              "tell its set-up",
                              object, given.size()));
    }
  }
  contact_.classifier = options.classifier;
}

double SetupJudge::nats(const Setup& setup) {
  double sum = 0.0;
  try {
    visit(setup, [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
      const InterpolatedMap field(map, map.prior);
      for (std::size_t e = 0; e < given.readings.size(); ++e) {
        sum +=
            log_likelihood(given.readings[e], field, touch.T_robot_sensor * touch.elements_mm[e]);
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

void SetupJudge::visit(const Setup& setup, const Take& take) {
  std::vector<ObjectTouches> halves;
  std::list<std::vector<std::uint8_t>> valid;  // of the touches
  for (const auto& [object, given] : touches_) {
    for (std::size_t half = 0; half < 2; ++half) {
      halves.push_back({object, {}});
      for (std::size_t i = half; i < given.size(); i += 2) {
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
  auto half = halves.begin();
  for (const auto& [object, given] : touches_) {
    for (std::size_t other = 2; other-- > 0;) {
      builder.clear();
      builder.add((half + static_cast<std::ptrdiff_t>(other))->touches);
      const OccupancyGrid map = builder.build(object);
      const std::vector<Touch>& judged = (half + static_cast<std::ptrdiff_t>(1 - other))->touches;
      for (std::size_t i = 0; i < judged.size(); ++i) {
        take(given[2 * i + (1 - other)], judged[i], map);
      }
    }
    half += 2;
  }
}

}  // namespace palpate
