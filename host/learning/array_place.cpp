#include "learning/setup_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <list>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "learning/local_search.hpp"
#include "model/angle_unit.hpp"
#include "model/map_likelihood.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

namespace {

/// Where the array sits in the tool, as "array_offset": by a pattern search, refined by a parabola
/// through the neighbours of the best place, whose curvature gives the standard deviations. None
/// where it sits where its elements are said to be, for all that the touches tell.
/// @param nats log-likelihood of the touches with the array at a pose in its own frame
std::optional<SetupFinding> offset_of(const std::function<double(const Pose&)>& nats,
                                      const Pose& start = {}) {
  std::map<std::array<double, 3>, double> known;
  const auto judged = [&](const Pose& at) {
    const auto [entry, is_new] =
        known.try_emplace({at.translation_mm.x, at.translation_mm.y, at.theta_rad});
    if (is_new) {
      entry->second = nats(at);
    }
    return entry->second;
  };
  const auto pose_of = [](const glm::dvec3& at) { return Pose{glm::dvec2(at), at.z}; };
  const auto& [found, top] = climb_poses({start, judged(start)}, {{1.0, 1.0}, 0.1}, 4, judged);
  const glm::dvec3 best(found.translation_mm, found.theta_rad);
  // The likelihood near its maximum as a parabola, in units of twice the finest steps.
  constexpr glm::dvec3 unit{0.25, 0.25, 0.025};
  const auto near = [&](const glm::dvec3& steps) { return judged(pose_of(best + unit * steps)); };
  const glm::dmat3 axis(1.0);
  glm::dvec3 slope;
  glm::dmat3 information;
  for (int a = 0; a < 3; ++a) {
    slope[a] = (near(axis[a]) - near(-axis[a])) / 2.0;
    information[a][a] = std::max(2.0 * top - near(axis[a]) - near(-axis[a]), 1e-3);
    for (int b = 0; b < a; ++b) {
      const double mixed = -(near(axis[a] + axis[b]) - near(axis[a] - axis[b]) -
                             near(axis[b] - axis[a]) + near(-axis[a] - axis[b])) /
                           4.0;
      const double limit = 0.9 * std::sqrt(information[a][a] * information[b][b]);
      information[a][b] = information[b][a] = std::clamp(mixed, -limit, limit);
    }
  }
  const glm::dmat3 covariance = glm::inverse(information);
  const glm::dvec3 offset = best + unit * glm::clamp(covariance * slope, -1.0, 1.0);
  std::array<double, 3> sd{};
  double excess = 0.0;  // of the largest part in standard deviations
  for (int a = 0; a < 3; ++a) {
    sd[a] = unit[a] * std::sqrt(std::max(covariance[a][a], 1e-4));
    excess = std::max(excess, std::abs(offset[a]) / std::max(sd[a], unit[a] / 4.0));
  }
  const double gain = std::max(judged(pose_of(offset)), top) - judged({});
  constexpr double least_excess = 3.0;
  if (!(gain > least_nats && excess > least_excess)) {
    return {};
  }
  return SetupFinding{
      "array_offset",
      gain,
      fmt::format("the array sits in the tool at x {:+.2f} +- {:.2f} mm, y {:+.2f} +- {:.2f} mm, "
                  "turned by {:+.1f} +- {:.1f} degrees, from where its elements are said to be: "
                  "import with the corrected array",
                  offset[0], sd[0], offset[1], sd[1], degrees(offset[2]), degrees(sd[2])),
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

/// Where the elements are a full grid, the eight orders in which it may be read.
std::vector<ElementOrder> orders_of(std::span<const glm::dvec2> elements_mm) {
  constexpr double same_mm = 1e-6;
  const auto less = [](double a, double b) { return a < b - same_mm; };
  std::set<double, decltype(less)> xs(less);
  std::set<double, decltype(less)> ys(less);
  for (const glm::dvec2& p : elements_mm) {
    xs.insert(p.x);
    ys.insert(p.y);
  }
  const std::vector<double> x(xs.begin(), xs.end());
  const std::vector<double> y(ys.begin(), ys.end());
  std::vector<ElementOrder> orders;
  if (x.size() < 2 || y.size() < 2 || x.size() * y.size() != elements_mm.size()) {
    return orders;
  }
  for (const bool by_rows : {true, false}) {
    for (const char* first : {"bottom-left", "bottom-right", "top-left", "top-right"}) {
      const bool right = std::string_view(first).ends_with("right");
      const bool top = std::string_view(first).starts_with("top");
      std::vector<glm::dvec2> order;
      for (std::size_t e = 0; e < elements_mm.size(); ++e) {
        const std::size_t i = by_rows ? e % x.size() : e / y.size();
        const std::size_t j = by_rows ? e / x.size() : e % y.size();
        order.emplace_back(x[right ? x.size() - 1 - i : i], y[top ? y.size() - 1 - j : j]);
      }
      orders.push_back({{fmt::format("first-element {}", first),
                         fmt::format("order {}", by_rows ? "rows" : "columns")},
                        std::move(order)});
    }
  }
  return orders;
}

/// Whether a turn of one array about its middle by a multiple of a right angle makes the other.
bool turns_into(std::span<const glm::dvec2> a, std::span<const glm::dvec2> b) {
  constexpr double same_mm = 1e-6;
  const glm::dvec2 middle = array_centre_mm(a);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Pose turn = Pose{middle, quarter * std::numbers::pi / 2.0} * Pose{-middle, 0.0};
    if (std::ranges::equal(
            a, b, [&](auto& p, auto& q) { return glm::distance(turn * p, q) < same_mm; })) {
      return true;
    }
  }
  return false;
}

}  // namespace

bool at_one_angle(const SetupJudge& judge, double rad) {
  constexpr double least_likeness = 0.97;  // length of the mean of unit vectors at the angles
  std::complex<double> sum;
  double count = 0.0;
  for (const auto& [object, touches] : judge.touches()) {
    for (const TriedTouch& given : touches) {
      sum += std::polar(1.0, rad * given.touch.T_robot_sensor.theta_rad);
      ++count;
    }
  }
  return std::abs(sum) > least_likeness * count;
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

void check_offset(SetupSearch& search) {
  if (at_one_angle(search.judge, search.setup.rad)) {
    search.check.remarks.emplace_back(
        "all touches are at nearly one angle of the sensor, which tells nothing of where the array "
        "sits in the tool: turn the sensor between the touches, by 90 degrees or so");
    return;
  }
  const auto nats_at = [&](const Pose& mount) {
    Setup other = search.setup;
    other.mount = mount;
    return search.judge.nats(other);
  };
  // Gains that differ from one side of the array to the other move the edges that it feels as much.
  constexpr double least_moved_mm = 0.3;
  const auto finding = offset_of(nats_at, search.setup.mount);
  search.setup.mount = {};
  if (finding && moved_mm(search.setup.elements_mm, *finding->array_offset) > least_moved_mm) {
    search.check.findings.push_back(*finding);
    search.setup.mount = *finding->array_offset;
  }
  search.nats = nats_at(search.setup.mount);
}

void check_pitch(SetupSearch& search) {
  const glm::dvec2 middle = array_centre_mm(search.setup.elements_mm);
  const auto scaled = [&](double scale) {
    Setup other = search.setup;
    for (glm::dvec2& p : other.elements_mm) {
      p = middle + scale * (p - middle);
    }
    return other;
  };
  Summit<double> found{1.0, search.nats};
  for (double step = 0.08; step >= 0.01; step /= 2.0) {
    found = climb(
        found,
        [&](double scale) {
          return std::array{scale * (1.0 - step), scale * (1.0 + step)};
        },
        [&](double scale) { return search.judge.nats(scaled(scale)); });
  }
  const auto& [best, nats] = found;
  // Touches at the places of a grid alone seem to be 3 % off.
  constexpr double least_change = 0.04;
  if (nats - search.nats > least_nats && std::abs(best - 1.0) > least_change) {
    search.check.findings.push_back(
        {"pitch", nats - search.nats,
         fmt::format("the elements lie {:.2f} times as far apart as they are said to: correct the "
                     "pitch in `array`, or import with the corrected array",
                     best)});
    search.setup = scaled(best);
    search.nats = nats;
  }
}

std::vector<ElementOrder> orders_but_for_turns(std::span<const glm::dvec2> elements_mm) {
  std::vector<ElementOrder> kept{{{}, {elements_mm.begin(), elements_mm.end()}}};
  for (ElementOrder& order : orders_of(elements_mm)) {
    if (std::ranges::none_of(kept, [&](const ElementOrder& other) {
          return turns_into(other.elements_mm, order.elements_mm);
        })) {
      kept.push_back(std::move(order));
    }
  }
  return kept;
}

void check_order(SetupSearch& search) {
  const auto orders = orders_of(search.setup.elements_mm);
  if (orders.empty()) {
    search.check.remarks.emplace_back(
        "the array is no grid: the order of its elements was not tried");
    return;
  }
  double best = search.nats;
  const ElementOrder* found = nullptr;
  for (const ElementOrder& order : orders) {
    Setup other = search.setup;
    other.elements_mm = order.elements_mm;
    const double nats = search.judge.nats(other);
    if (nats > best) {
      best = nats;
      found = &order;
    }
  }
  // Where touches overlap little, how the elements lie among the cells tells orders apart by a
  // little; a wrong order costs a good part of all that the touches tell.
  const double gain = best - search.nats;
  if (found != nullptr && gain > std::max(least_nats, least_share * std::abs(search.nats))) {
    search.check.findings.push_back(
        {"element_order", gain,
         fmt::format("the elements are read in another order: import with `{}`",
                     fmt::join(found->options, "` and `")),
         found->options});
    search.setup.elements_mm = found->elements_mm;
    search.nats = best;
  }
}

}  // namespace palpate
