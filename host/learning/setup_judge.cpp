#include "learning/setup_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <glm/geometric.hpp>

#include "model/map_likelihood.hpp"
#include "model/refuse.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/fit.hpp"

namespace palpate {

std::vector<glm::dvec2> Setup::mounted_mm() const {
  std::vector<glm::dvec2> result;
  for (const glm::dvec2& p : elements_mm) {
    result.push_back(mount * p);
  }
  return result;
}

Pose Setup::pose_of(const TriedTouch& given) const {
  const Pose& pose = given.touch.T_robot_sensor;
  return {mm * pose.translation_mm, rad * pose.theta_rad};
}

SetupJudge::SetupJudge(Device& device, std::span<const Recording* const> recordings,
                       const MapOptions& options, std::size_t most_touches)
    : device_(device), options_(options) {
  bool all_in_contact = true;
  for (const Recording* recording : recordings) {
    // An object that was never in contact is missed.
    std::vector<TriedTouch>& tried = touches_[recording->object];
    const std::size_t stride = (recording->size() - 1) / most_touches + 1;
    for (std::size_t i = 0; i < recording->size(); i += stride) {
      const Touch touch = recording->touch(i);
      TouchEvidence evidence(touch, {.classifier = options.classifier});
      all_in_contact =
          all_in_contact &&
          std::ranges::find(evidence.readings, Reading::no_contact) == evidence.readings.end();
      if (evidence.in_contact()) {
        tried.push_back({touch, std::move(evidence.readings), recording->path, i});
      }
    }
  }
  for (const auto& [object, given] : touches_) {
    if (given.empty()) {
      refuse(fmt::format("object '{}'", object),
             "no element is in contact in any of its touches; lower `threshold`, or look at the "
             "array's wiring and its baseline");
    }
    if (given.size() < 4) {
      refuse(fmt::format("object '{}'", object),
             "{} touches in contact; four or more of every object tell its set-up", given.size());
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
  const auto add = [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
    const MapLikelihood likelihood(map, contact_);
    for (std::size_t e = 0; e < given.readings.size(); ++e) {
      sum += likelihood.at(given.readings[e], touch.T_robot_sensor * touch.elements_mm[e]);
    }
  };
  const bool too_far_apart = input_fault_of([&] { visit(setup, add); }).has_value();
  return too_far_apart ? -1e300 : sum;
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
      if (is_living(touch, e)) {
        const Reading reading = given.readings[e];
        result.told += likelihood.at(reading, touch.T_robot_sensor * touch.elements_mm[e]) -
                       likelihood.of(reading, prior_log_odds);
      }
    }
  });
  return result;
}

void SetupJudge::visit(const Setup& setup, const Take& take) {
  const std::vector<glm::dvec2> elements_mm = setup.mounted_mm();
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
        touch.T_robot_sensor = setup.pose_of(given[i]);
        touch.elements_mm = elements_mm;
        if (!setup.valid.empty()) {
          std::vector<std::uint8_t>& tried = valid.emplace_back(setup.valid);
          for (std::size_t e = 0; e < touch.valid.size(); ++e) {
            tried[e] &= touch.valid[e];
          }
          touch.valid = tried;
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

namespace {

constexpr double farthest_mount_mm = 60.0;
constexpr std::size_t most_touches = 60;  // of an object
constexpr std::size_t most_objects = 4;
constexpr std::size_t most_elements = 64;

/// The stride that leaves at most `limit` of `count` things.
std::size_t stride(std::size_t count, std::size_t limit) { return (count + limit - 1) / limit; }

/// Touches of one object.
struct MountedTouches {
  std::vector<Pose> poses;
  std::vector<std::vector<Reading>> readings;  ///< [touch][e] of the elements that count
  glm::dvec2 middle_mm{0.0};
  double span_mm = 0.0;  ///< of the poses about the middle
};

/// The map of one object. Between uses all is 0, and it is kept: most squares are never met.
struct Squares {
  std::vector<std::array<std::uint32_t, 2>> counts;  ///< [y, x] of No Contact, In Contact
  std::vector<std::size_t> used;                     ///< whose counts are not 0
};

/// Judges mounts by a map of squares, in each of which all readings of an object are one
/// Beta-distributed share of contact.
class MountSearch {
 public:
  MountSearch(const SetupJudge& judge, const Setup& setup)
      : middle_mm_(array_centre_mm(setup.elements_mm)) {
    const std::size_t every_element = stride(setup.elements_mm.size(), most_elements);
    for (std::size_t e = 0; e < setup.elements_mm.size(); e += every_element) {
      elements_mm_.push_back(setup.elements_mm[e] - middle_mm_);
      reach_mm_ = std::max(reach_mm_, glm::length(elements_mm_.back()));
    }
    for (const auto& [object, touches] : judge.touches()) {
      if (objects_.size() < most_objects) {
        objects_.push_back(mounted(touches, setup, every_element));
      }
    }
    for (std::size_t n = 0; n <= most_touches * elements_mm_.size(); ++n) {
      const auto count = static_cast<double>(n);
      log_gamma_half_.push_back(std::lgamma(count + 0.5) - std::lgamma(0.5));
      log_factorial_.push_back(std::lgamma(count + 1.0));
    }
  }

  Summit<Pose> run() const {
    constexpr double step_mm = 3.0;
    constexpr int angles = 30;
    constexpr std::size_t most_refined = 40;
    std::vector<Summit<Pose>> found;
    const int limit = static_cast<int>(farthest_mount_mm / step_mm);
    visit_grid({limit, limit, 0}, [&](const glm::dvec3& at) {
      for (int a = 0; glm::length(at) <= limit && a < angles; ++a) {
        found.push_back(
            {{middle_mm_ + step_mm * glm::dvec2(at), a * 2.0 * std::numbers::pi / angles}});
      }
    });
    tbb::parallel_for(std::size_t{0}, found.size(),
                      [&](std::size_t k) { found[k].value = nats(found[k].place, 3.0, 2); });
    const auto fewer = std::min(most_refined, found.size());
    std::ranges::partial_sort(found, found.begin() + static_cast<std::ptrdiff_t>(fewer),
                              std::ranges::greater{}, &Summit<Pose>::value);
    found.resize(fewer);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t k) {
      refine(found[k], 2.0, {{2.0, 2.0}, 0.12}, 1);
      refine(found[k], 1.5, {{1.0, 1.0}, 0.06}, 2);
    });
    Summit<Pose> best = *std::ranges::max_element(found, {}, &Summit<Pose>::value);
    best.place = best.place * Pose{-middle_mm_, 0.0};
    best.place.theta_rad = wrap_angle(best.place.theta_rad);
    return best;
  }

 private:
  static MountedTouches mounted(const std::vector<TriedTouch>& touches, const Setup& setup,
                                std::size_t every_element) {
    MountedTouches result;
    for (std::size_t i = 0; i < touches.size(); i += stride(touches.size(), most_touches)) {
      result.poses.push_back(setup.pose_of(touches[i]));
      result.middle_mm += result.poses.back().translation_mm;
      std::vector<Reading>& readings = result.readings.emplace_back();
      for (std::size_t e = 0; e < touches[i].readings.size(); e += every_element) {
        readings.push_back(touches[i].readings[e]);
      }
    }
    result.middle_mm /= static_cast<double>(result.poses.size());
    for (const Pose& pose : result.poses) {
      const double far_mm = glm::distance(pose.translation_mm, result.middle_mm);
      result.span_mm = std::max(result.span_mm, far_mm);
    }
    return result;
  }

  /// @param place of the array's middle in the tool
  /// @param every of so many touches one counts
  double nats(const Pose& place, double square_mm, std::size_t every = 1) const {
    std::vector<glm::dvec2> elements_mm;
    for (const glm::dvec2& p : elements_mm_) {
      elements_mm.push_back(place * p);
    }
    auto& [counts, used] = squares_.local();
    double sum = 0.0;
    for (const MountedTouches& object : objects_) {
      const double half_mm =
          object.span_mm + glm::length(place.translation_mm) + reach_mm_ + square_mm;
      const std::size_t side = static_cast<std::size_t>(2.0 * half_mm / square_mm) + 2;
      counts.resize(std::max(counts.size(), side * side));
      const glm::dvec2 corner = object.middle_mm - half_mm;
      for (std::size_t i = 0; i < object.poses.size(); i += every) {
        const glm::dvec2 along = rotate(object.poses[i].theta_rad, {1.0 / square_mm, 0.0});
        const glm::dvec2 at = (object.poses[i].translation_mm - corner) / square_mm;
        for (std::size_t e = 0; e < elements_mm.size(); ++e) {
          if (const Reading reading = object.readings[i][e]; reading != Reading::unknown) {
            const glm::dvec2& p = elements_mm[e];
            const auto x = static_cast<std::size_t>(at.x + along.x * p.x - along.y * p.y);
            const auto y = static_cast<std::size_t>(at.y + along.y * p.x + along.x * p.y);
            auto& [none, contact] = counts[y * side + x];
            if (none + contact == 0) {
              used.push_back(y * side + x);
            }
            ++(is_contact(reading) ? contact : none);
          }
        }
      }
      for (const std::size_t square : used) {
        const auto& [none, contact] = counts[square];
        sum += log_gamma_half_[none] + log_gamma_half_[contact] - log_factorial_[none + contact];
        counts[square] = {};
      }
      used.clear();
    }
    return sum;
  }

  void refine(Summit<Pose>& mount, double square_mm, const Pose& step, int levels) const {
    const auto value_of = [&](const Pose& at) { return nats(at, square_mm); };
    mount = climb_poses({mount.place, value_of(mount.place)}, step, levels, value_of);
  }

  glm::dvec2 middle_mm_;                 ///< of the array
  std::vector<glm::dvec2> elements_mm_;  ///< about it
  std::vector<MountedTouches> objects_;
  double reach_mm_ = 0.0;
  std::vector<double> log_gamma_half_;  ///< [n] lgamma(n + 1/2) - lgamma(1/2)
  std::vector<double> log_factorial_;
  mutable tbb::enumerable_thread_specific<Squares> squares_;
};

}  // namespace

Summit<Pose> search_mount(const SetupJudge& judge, const Setup& setup) {
  return MountSearch(judge, setup).run();
}

}  // namespace palpate
