#include "learning/setup_check.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "learning/setup_judge.hpp"
#include "model/bounding_box.hpp"
#include "palpate/error.hpp"
#include "palpate/fit.hpp"

namespace palpate {

namespace {

/// Nats that a finding needs. Of sound set-ups none came near it; see tests/learning.
constexpr double least_nats = 12.0;

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

/// Poses in degrees or metres, where the numbers allow for it.
void check_units(SetupJudge& judge, Setup& setup, double& nats,
                 std::vector<SetupFinding>& findings) {
  constexpr double circle = 2.0 * std::numbers::pi;
  BoundingBox places;
  double most_angle = 0.0;
  for (const auto& [object, touches] : judge.touches()) {
    for (const TriedTouch& given : touches) {
      places.take_in(given.touch.T_robot_sensor.translation_mm);
      most_angle = std::max(most_angle, std::abs(given.touch.T_robot_sensor.theta_rad));
    }
  }
  const double reach_mm = array_reach_mm(setup.elements_mm);
  const bool may_be_metres = places.diagonal() < 0.1 * reach_mm;
  const bool may_be_degrees = most_angle > circle;
  if (!may_be_metres && !may_be_degrees) {
    return;
  }
  Setup other = setup;
  other.mm = may_be_metres ? 1000.0 : 1.0;
  other.rad = may_be_degrees ? std::numbers::pi / 180.0 : 1.0;
  const double gain = judge.nats(other) - nats;
  if (gain > least_nats) {
    const std::string option =
        fmt::format("pose-unit {},{}", may_be_metres ? "m" : "mm", may_be_degrees ? "deg" : "rad");
    findings.push_back({"pose_unit", gain,
                        fmt::format("the sensor's poses are in {}: import them with `{}`",
                                    may_be_metres && may_be_degrees ? "metres and degrees"
                                    : may_be_metres                 ? "metres"
                                                                    : "degrees",
                                    option),
                        option});
    setup = other;
    nats += gain;
  }
}

/// Where the elements are a full grid, the eight orders in which it may be read, each with the
/// options of an import that say so.
std::vector<std::pair<std::string, std::vector<glm::dvec2>>> orders_of(
    std::span<const glm::dvec2> elements_mm) {
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
  std::vector<std::pair<std::string, std::vector<glm::dvec2>>> orders;
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
      orders.emplace_back(
          fmt::format("first-element {} --order {}", first, by_rows ? "rows" : "columns"),
          std::move(order));
    }
  }
  return orders;
}

void check_order(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check) {
  const auto orders = orders_of(setup.elements_mm);
  if (orders.empty()) {
    check.remarks.emplace_back("the array is no grid: the order of its elements was not tried");
    return;
  }
  const std::vector<glm::dvec2> given = setup.elements_mm;
  double best = nats;
  std::string option;
  for (const auto& [words, elements_mm] : orders) {
    Setup other = setup;
    other.elements_mm = elements_mm;
    const double tried = elements_mm == given ? nats : judge.nats(other);
    if (tried > best) {
      best = tried;
      option = words;
      check.elements_mm = elements_mm;
    }
  }
  if (best - nats > least_nats) {
    check.findings.push_back({"element_order", best - nats,
                              fmt::format("the elements are read in another order: import with "
                                          "`{}`",
                                          option),
                              option});
    setup.elements_mm = check.elements_mm;
    nats = best;
  }
  check.elements_mm = setup.elements_mm;
}

/// Length of the mean of unit vectors at the sensor's angles: 1 where all are alike.
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

/// The array's offset in the tool by a pattern search, refined by a parabola through its
/// neighbours, whose curvature gives the standard error.
void check_offset(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check) {
  constexpr double alike = 0.97;
  if (likeness_of_angles(judge, setup.rad) > alike) {
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
    excess = std::max(excess, std::abs(offset[a]) / std::max(sd[a], finest[a]));
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
             "import with the array that `write-array` writes",
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
  constexpr double least_change = 0.025;
  if (most - nats > least_nats && std::abs(best - 1.0) > least_change) {
    check.findings.push_back(
        {"pitch", most - nats,
         fmt::format("the elements lie {:.2f} times as far apart as they are said to: correct the "
                     "pitch in `array`, or import with the array that `write-array` writes",
                     best),
         ""});
    setup = scaled(best);
    nats = most;
    check.elements_mm = setup.elements_mm;
  }
}

/// Elements that always, or never, read contact, against what their places predict.
void check_elements(SetupJudge& judge, Setup& setup, SetupCheck& check) {
  struct Element {
    std::size_t contacts = 0;
    std::size_t known = 0;
    double surprise = 0.0;  ///< above what is expected, in nats
  };
  std::vector<Element> elements(setup.elements_mm.size());
  judge.visit(setup, [&](const TriedTouch&, const Touch& touch, const OccupancyGrid& map) {
    const InterpolatedMap field(map, map.prior);
    const std::vector<Reading> readings = judge.contact().classify(touch);
    for (std::size_t e = 0; e < readings.size(); ++e) {
      if (readings[e] == Reading::unknown) {
        continue;
      }
      const glm::dvec2 p = touch.T_robot_sensor * touch.elements_mm[e];
      const double yes = judge.log_likelihood(Reading::in_contact, field, p);
      const double no = judge.log_likelihood(Reading::no_contact, field, p);
      const double share = 1.0 / (1.0 + std::exp(no - yes));
      const bool contact = is_contact(readings[e]);
      elements[e].contacts += contact ? 1 : 0;
      ++elements[e].known;
      elements[e].surprise += share * yes + (1.0 - share) * no - (contact ? yes : no);
    }
  });
  setup.valid.assign(elements.size(), 1);
  for (const bool stuck : {false, true}) {
    std::vector<std::size_t> found;
    double nats = 0.0;
    for (std::size_t e = 0; e < elements.size(); ++e) {
      const Element& element = elements[e];
      if (element.known > 0 && element.contacts == (stuck ? element.known : 0) &&
          element.surprise > least_nats) {
        found.push_back(e);
        setup.valid[e] = 0;
        nats += element.surprise;
      }
    }
    if (!found.empty()) {
      const std::string option = fmt::format("dead {}", fmt::join(found, ","));
      check.findings.push_back(
          {stuck ? "stuck_elements" : "dead_elements", nats,
           fmt::format("{} contact in every touch, on the object or beside it: "
                       "elements {}; import with `{}`",
                       stuck ? "always in" : "never in", fmt::join(found, ", "), option),
           option});
    }
  }
}

/// Touches that fit the map of the others far worse than all else.
void check_touches(SetupJudge& judge, const Setup& setup, SetupCheck& check) {
  constexpr double least_z = -6.0;
  std::map<std::string, std::vector<std::size_t>> found;
  double nats = 0.0;
  std::size_t count = 0;
  judge.visit(setup, [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
    const std::optional<Fit> fit = fit_of({&touch, 1}, {}, map, judge.contact());
    if (fit && fit->z < least_z) {
      found[given.recording].push_back(given.index);
      nats -= fit->z;
      ++count;
    }
    check.touches += 1;
  });
  if (count == 0 || 4 * count > check.touches) {  // with so many, it is the set-up
    return;
  }
  for (auto& [recording, indices] : found) {
    std::ranges::sort(indices);
    check.findings.push_back(
        {"contradicting", nats,
         fmt::format("{}: touches that contradict the others: {}; the object moved, or their poses "
                     "are others: leave them out",
                     recording, fmt::join(indices, ", ")),
         ""});
  }
}

}  // namespace

SetupCheck check_setup(Device& device, std::span<const Recording> recordings,
                       const MapOptions& options, const std::function<void(double)>& progress) {
  for (const Recording& recording : recordings) {
    if (recording.elements_mm.size() != recording.elements() ||
        recording.elements_mm != recordings.front().elements_mm) {
      throw Error(Fault::input,
                  fmt::format("{}: its array is not that of all touches; check recordings of one "
                              "array that does not change",
                              recording.path));
    }
  }
  const auto show = [&](double fraction) {
    if (progress) {
      progress(fraction);
    }
  };
  SetupJudge judge(device, recordings, options);
  SetupCheck check{.elements_mm = recordings.front().elements_mm};
  Setup setup{.elements_mm = check.elements_mm};
  double nats = judge.nats(setup);
  check_units(judge, setup, nats, check.findings);
  show(0.1);
  check_order(judge, setup, nats, check);
  show(0.3);
  check_offset(judge, setup, nats, check);
  show(0.7);
  check_pitch(judge, setup, nats, check);
  show(0.9);
  check_elements(judge, setup, check);
  check_touches(judge, setup, check);
  return check;
}

}  // namespace palpate
