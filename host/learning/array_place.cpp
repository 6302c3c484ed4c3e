#include "learning/array_place.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace palpate {

namespace {

/// The elements as an array at this pose in their frame has them, scaled about its middle.
std::vector<glm::dvec2> placed(std::span<const glm::dvec2> elements_mm, const Pose& offset,
                               double scale = 1.0) {
  const glm::dvec2 middle = array_centre_mm(elements_mm);
  std::vector<glm::dvec2> result;
  for (const glm::dvec2& p : elements_mm) {
    result.push_back(offset * (middle + scale * (p - middle)));
  }
  return result;
}

}  // namespace

double likeness_of_angles(const SetupJudge& judge, double rad) {
  std::complex<double> sum;
  double count = 0.0;
  for (const auto& [object, touches] : judge.touches()) {
    for (const TriedTouch& given : touches) {
      sum += std::polar(1.0, rad * given.touch.T_robot_sensor.theta_rad);
      ++count;
    }
  }
  return std::abs(sum) / count;
}

void check_offset(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check) {
  if (likeness_of_angles(judge, setup.rad) > one_angle) {
    check.remarks.emplace_back(
        "all touches are at nearly one angle of the sensor, which tells nothing of where the array "
        "sits in the tool: turn the sensor between the touches, by 90 degrees or so");
    return;
  }
  using Place = std::array<double, 3>;
  const auto pose_of = [](const Place& at) { return Pose{{at[0], at[1]}, at[2]}; };
  std::map<Place, double> known{{Place{}, nats}};
  const auto judged = [&](const Place& at) {
    const auto found = known.find(at);
    if (found != known.end()) {
      return found->second;
    }
    Setup other = setup;
    other.elements_mm = placed(setup.elements_mm, pose_of(at));
    return known.emplace(at, judge.nats(other)).first->second;
  };
  Place best{};
  const Place finest{0.125, 0.125, 0.0125};
  for (double step = 8.0; step >= 1.0;) {  // in units of the finest
    Place next = best;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const double side : {-1.0, 1.0}) {
        Place at = best;
        at[axis] += side * step * finest[axis];
        next = judged(at) > judged(next) ? at : next;
      }
    }
    step = next == best ? step / 2.0 : step;
    best = next;
  }
  // The likelihood near its maximum as a parabola, in units of twice the finest steps.
  const double top = judged(best);
  const auto near = [&](std::size_t a, double da, std::size_t b, double db) {
    Place at = best;
    at[a] += da * 2.0 * finest[a];
    at[b] += db * 2.0 * finest[b];
    return judged(at);
  };
  glm::dvec3 slope;
  glm::dmat3 information;
  for (int a = 0; a < 3; ++a) {
    slope[a] = (near(a, 1, a, 0) - near(a, -1, a, 0)) / 2.0;
    information[a][a] = std::max(2.0 * top - near(a, 1, a, 0) - near(a, -1, a, 0), 1e-3);
    for (int b = 0; b < a; ++b) {
      const double mixed =
          -(near(a, 1, b, 1) - near(a, 1, b, -1) - near(a, -1, b, 1) + near(a, -1, b, -1)) / 4.0;
      const double most = 0.9 * std::sqrt(information[a][a] * information[b][b]);
      information[a][b] = information[b][a] = std::clamp(mixed, -most, most);
    }
  }
  const glm::dmat3 covariance = glm::inverse(information);
  const glm::dvec3 peak = glm::clamp(covariance * slope, -1.0, 1.0);
  Place offset = best;
  std::array<double, 3> sd{};
  double excess = 0.0;  // of the largest part in standard deviations
  for (int a = 0; a < 3; ++a) {
    offset[a] += 2.0 * finest[a] * peak[a];
    sd[a] = 2.0 * finest[a] * std::sqrt(std::max(covariance[a][a], 1e-4));
    excess = std::max(excess, std::abs(offset[a]) / std::max(sd[a], finest[a] / 2.0));
  }
  const double gain = std::max(judged(offset), top) - nats;
  constexpr double least_excess = 3.0;
  if (gain > least_nats && excess > least_excess) {
    const Pose pose = pose_of(offset);
    constexpr double degrees = 180.0 / std::numbers::pi;
    check.findings.push_back(
        {"array_offset", gain,
         fmt::format(
             "the array sits in the tool at x {:+.2f} +- {:.2f} mm, y {:+.2f} +- {:.2f} mm, "
             "turned by {:+.1f} +- {:.1f} degrees, from where its elements are said to be: "
             "import with the corrected array",
             offset[0], sd[0], offset[1], sd[1], degrees * offset[2], degrees * sd[2]),
         "", pose, sd});
    setup.elements_mm = placed(setup.elements_mm, pose);
    nats = judge.nats(setup);
    check.elements_mm = setup.elements_mm;
  }
}

void check_pitch(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check) {
  const auto scaled = [&](double scale) {
    Setup other = setup;
    other.elements_mm = placed(setup.elements_mm, {}, scale);
    return other;
  };
  double best = 1.0;
  double most = nats;
  for (double step = 0.08; step >= 0.01;) {
    double next = best;
    for (const double tried : {best * (1.0 - step), best * (1.0 + step)}) {
      const double other = judge.nats(scaled(tried));
      next = other > most ? tried : next;
      most = std::max(most, other);
    }
    step = next == best ? step / 2.0 : step;
    best = next;
  }
  // Touches at the places of a grid alone seem to be 3 % off.
  constexpr double least_change = 0.04;
  if (most - nats > least_nats && std::abs(best - 1.0) > least_change) {
    check.findings.push_back(
        {"pitch", most - nats,
         fmt::format("the elements lie {:.2f} times as far apart as they are said to: correct the "
                     "pitch in `array`, or import with the corrected array",
                     best),
         ""});
    setup = scaled(best);
    nats = most;
    check.elements_mm = setup.elements_mm;
  }
}

}  // namespace palpate
