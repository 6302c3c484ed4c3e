#include "learning/array_place.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <list>
#include <map>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "model/map_likelihood.hpp"
#include "model/touch_evidence.hpp"

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

/// Where the array sits in the tool, as "array_offset": by a pattern search, refined by a parabola
/// through the neighbours of the best place, whose curvature gives the standard deviations. None
/// where it sits where its elements are said to be, for all that the touches tell.
/// @param nats log-likelihood of the touches with the array at a pose in its own frame
std::optional<SetupFinding> offset_of(const std::function<double(const Pose&)>& nats,
                                      const Pose& start = {}) {
  using Place = std::array<double, 3>;
  const auto pose_of = [](const Place& at) { return Pose{{at[0], at[1]}, at[2]}; };
  std::map<Place, double> known;
  const auto judged = [&](const Place& at) {
    const auto found = known.find(at);
    if (found != known.end()) {
      return found->second;
    }
    return known.emplace(at, nats(pose_of(at))).first->second;
  };
  Place best{start.translation_mm.x, start.translation_mm.y, start.theta_rad};
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
  const double gain = std::max(judged(offset), top) - judged({});
  constexpr double least_excess = 3.0;
  if (!(gain > least_nats && excess > least_excess)) {
    return {};
  }
  constexpr double degrees = 180.0 / std::numbers::pi;
  return SetupFinding{
      "array_offset",
      gain,
      fmt::format("the array sits in the tool at x {:+.2f} +- {:.2f} mm, y {:+.2f} +- {:.2f} mm, "
                  "turned by {:+.1f} +- {:.1f} degrees, from where its elements are said to be: "
                  "import with the corrected array",
                  offset[0], sd[0], offset[1], sd[1], degrees * offset[2], degrees * sd[2]),
      {},
      pose_of(offset),
      sd};
}

/// How far an offset moves the elements, root mean square.
double moved_mm(std::span<const glm::dvec2> elements_mm, const Pose& offset) {
  double squares = 0.0;
  for (const glm::dvec2& p : elements_mm) {
    const glm::dvec2 moved = offset * p - p;
    squares += glm::dot(moved, moved);
  }
  return std::sqrt(squares / static_cast<double>(elements_mm.size()));
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

std::optional<SetupFinding> offset_on_drawings(const std::vector<Press>& presses,
                                               const std::vector<OccupancyGrid>& maps,
                                               const ContactClassifier& classifier) {
  struct Tried {
    TouchEvidence evidence;
    Pose T_object_sensor;
    const MapLikelihood* likelihood;
  };
  std::list<MapLikelihood> likelihoods;
  std::vector<Tried> tried;
  for (const OccupancyGrid& map : maps) {
    if (!map.drawn) {
      continue;
    }
    const ContactModel contact{.classifier = classifier, .prior = map.prior};
    const MapLikelihood& likelihood = likelihoods.emplace_back(map, contact);
    for (const Press& press : presses) {
      if (press.label == map.label) {
        const Touch& touch = press.touches.front();
        tried.push_back({TouchEvidence(touch, contact),
                         *press.T_object_robot * touch.T_robot_sensor, &likelihood});
      }
    }
  }
  if (tried.empty()) {
    return {};
  }
  return offset_of([&](const Pose& offset) {
    std::vector<double> nats(tried.size());
    tbb::parallel_for(std::size_t{0}, tried.size(), [&](std::size_t i) {
      const auto& [evidence, T_object_sensor, likelihood] = tried[i];
      nats[i] = likelihood->at(evidence, T_object_sensor * offset);
    });
    return std::accumulate(nats.begin(), nats.end(), 0.0);
  });
}

std::vector<Press> with_offset(std::vector<Press> presses, const Pose& offset) {
  for (Press& press : presses) {
    const Pose& T_robot_sensor = press.touches.front().T_robot_sensor;
    press.T_object_robot =
        *press.T_object_robot * T_robot_sensor * offset * inverse(T_robot_sensor);
  }
  return presses;
}

void check_offset(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check,
                  const Pose& start) {
  if (likeness_of_angles(judge, setup.rad) > one_angle) {
    check.remarks.emplace_back(
        "all touches are at nearly one angle of the sensor, which tells nothing of where the array "
        "sits in the tool: turn the sensor between the touches, by 90 degrees or so");
    return;
  }
  const auto setup_at = [&](const Pose& offset) {
    Setup other = setup;
    other.elements_mm = placed(setup.elements_mm, offset);
    return other;
  };
  // Gains that differ from one side of the array to the other move the edges that it feels as much.
  constexpr double least_moved_mm = 0.3;
  const auto finding =
      offset_of([&](const Pose& offset) { return judge.nats(setup_at(offset)); }, start);
  if (finding && moved_mm(setup.elements_mm, *finding->array_offset) > least_moved_mm) {
    check.findings.push_back(*finding);
    setup = setup_at(*finding->array_offset);
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
                     best)});
    setup = scaled(best);
    nats = most;
    check.elements_mm = setup.elements_mm;
  }
}

}  // namespace palpate
