#include "learning/setup_check.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>

#include "learning/array_place.hpp"
#include "learning/setup_judge.hpp"
#include "model/bounding_box.hpp"
#include "palpate/error.hpp"
#include "palpate/fit.hpp"

namespace palpate {

namespace {

/// A unit that poses may really have.
struct PoseUnit {
  bool metres = false;
  bool degrees = false;

  Setup of(Setup setup) const {
    setup.mm = metres ? 1000.0 : 1.0;
    setup.rad = degrees ? std::numbers::pi / 180.0 : 1.0;
    return setup;
  }
};

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
  // An angle that counts turns exceeds a circle in radians, too.
  std::optional<PoseUnit> best;
  double gain = least_nats;
  for (const PoseUnit& unit : {PoseUnit{may_be_metres, may_be_degrees},
                               PoseUnit{may_be_metres, false}, PoseUnit{false, may_be_degrees}}) {
    if (!unit.metres && !unit.degrees) {
      continue;
    }
    if (const double gained = judge.nats(unit.of(setup)) - nats; gained > gain) {
      best = unit;
      gain = gained;
    }
  }
  if (!best) {
    return;
  }
  const std::string option =
      fmt::format("pose-unit {},{}", best->metres ? "m" : "mm", best->degrees ? "deg" : "rad");
  findings.push_back({"pose_unit",
                      gain,
                      fmt::format("the sensor's poses are in {}: import them with `{}`",
                                  best->metres && best->degrees ? "metres and degrees"
                                  : best->metres                ? "metres"
                                                                : "degrees",
                                  option),
                      {option}});
  setup = best->of(setup);
  nats += gain;
}

/// Whether the touches are, but for a part of the array's reach, at one place and angle. Any array
/// then makes a map of its own that explains them.
bool at_one_place(const SetupJudge& judge, const Setup& setup) {
  constexpr double part = 0.5;
  double widest_mm = 0.0;
  for (const auto& [object, touches] : judge.touches()) {
    BoundingBox places;
    for (const TriedTouch& given : touches) {
      places.take_in(setup.mm * given.touch.T_robot_sensor.translation_mm);
    }
    widest_mm = std::max(widest_mm, places.diagonal());
  }
  return widest_mm < part * array_reach_mm(setup.elements_mm) &&
         likeness_of_angles(judge, setup.rad) > one_angle;
}

/// The elements in the order of their readings, and the options of an import that say so.
struct ElementOrder {
  std::vector<std::string> options;
  std::vector<glm::dvec2> elements_mm;
};

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

void check_order(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check) {
  const auto orders = orders_of(setup.elements_mm);
  if (orders.empty()) {
    check.remarks.emplace_back("the array is no grid: the order of its elements was not tried");
    return;
  }
  const std::vector<glm::dvec2> given = setup.elements_mm;
  double best = nats;
  std::vector<std::string> options;
  for (const auto& [import_options, elements_mm] : orders) {
    Setup other = setup;
    other.elements_mm = elements_mm;
    const double tried = elements_mm == given ? nats : judge.nats(other);
    if (tried > best) {
      best = tried;
      options = import_options;
      check.elements_mm = elements_mm;
    }
  }
  // Where touches overlap little, how the elements lie among the cells tells orders apart by a
  // little; a wrong order costs a good part of all that the touches tell.
  constexpr double least_share = 0.05;
  if (best - nats > std::max(least_nats, least_share * std::abs(nats))) {
    check.findings.push_back(
        {"element_order", best - nats,
         fmt::format("the elements are read in another order: import with `{}`",
                     fmt::join(options, "` and `")),
         options});
    setup.elements_mm = check.elements_mm;
    nats = best;
  }
  check.elements_mm = setup.elements_mm;
}

/// Elements that always, or never, read contact, against what their places predict.
void check_elements(SetupJudge& judge, Setup& setup, SetupCheck& check) {
  struct Element {
    std::size_t contacts = 0;
    std::size_t known = 0;
    double surprise = 0.0;  ///< above what is expected, in nats
  };
  std::vector<Element> elements(setup.elements_mm.size());
  judge.visit(setup, [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
    const InterpolatedMap field(map, map.prior);
    for (std::size_t e = 0; e < given.readings.size(); ++e) {
      if (given.readings[e] == Reading::unknown) {
        continue;
      }
      const glm::dvec2 p = touch.T_robot_sensor * touch.elements_mm[e];
      const double yes = judge.log_likelihood(Reading::in_contact, field, p);
      const double no = judge.log_likelihood(Reading::no_contact, field, p);
      const double share = 1.0 / (1.0 + std::exp(no - yes));
      const bool contact = is_contact(given.readings[e]);
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
          {stuck ? "stuck_elements" : "dead_elements",
           nats,
           fmt::format("{} contact in every touch, on the object or beside it: "
                       "elements {}; import with `{}`",
                       stuck ? "always in" : "never in", fmt::join(found, ", "), option),
           {option}});
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
                     recording, fmt::join(indices, ", "))});
  }
}

/// Every so many touches of a recording, so that there are at most `most`.
Recording thinned(const Recording& recording, std::size_t most) {
  const std::size_t e = recording.elements();
  const std::size_t every = (recording.size() + most - 1) / most;
  Recording few{.path = recording.path,
                .object = recording.object,
                .pressure_unit = recording.pressure_unit,
                .elements_mm = recording.elements_mm};
  for (std::size_t i = 0; i < recording.size(); i += every) {
    const Touch touch = recording.touch(i);
    few.T_robot_sensor.push_back(touch.T_robot_sensor);
    few.pressure.insert(few.pressure.end(), touch.pressure.begin(), touch.pressure.end());
    few.valid.insert(few.valid.end(), touch.valid.begin(), touch.valid.end());
  }
  if (few.valid.size() != few.size() * e) {
    few.valid.clear();
  }
  return few;
}

/// What the recordings' logs showed.
std::vector<SetupFinding> findings_of_logs(std::span<const Recording> recordings) {
  std::vector<SetupFinding> findings;
  for (const Recording& recording : recordings) {
    for (const SetupFinding& finding : recording.findings) {
      findings.push_back(finding);
      findings.back().words = fmt::format("{}: {}", recording.path, finding.words);
    }
  }
  return findings;
}

}  // namespace

std::optional<SetupFinding> suspected_order(Device& device, std::span<const Recording> recordings,
                                            const MapOptions& options) {
  constexpr std::size_t most_objects = 3;
  constexpr std::size_t least_touches = 20;
  constexpr std::size_t most_touches = 40;
  std::vector<Recording> few;
  for (const Recording& recording : recordings) {
    const bool fits = recording.size() >= least_touches &&
                      recording.elements_mm.size() == recording.elements() &&
                      recording.elements_mm == recordings.front().elements_mm;
    if (fits && few.size() < most_objects) {
      few.push_back(thinned(recording, most_touches));
    }
  }
  if (few.empty()) {
    return {};
  }
  SetupCheck check{.elements_mm = few.front().elements_mm};
  Setup setup{.elements_mm = check.elements_mm};
  try {
    SetupJudge judge(device, few, options);
    if (!at_one_place(judge, setup)) {
      double nats = judge.nats(setup);
      check_order(judge, setup, nats, check);
    }
  } catch (const Error& error) {
    if (error.fault() != Fault::input) {
      throw;
    }
  }
  return check.findings.empty() ? std::nullopt : std::optional(check.findings.front());
}

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
  SetupCheck check{.elements_mm = recordings.front().elements_mm};
  const std::vector<SetupFinding> logged = findings_of_logs(recordings);
  std::optional<SetupJudge> some_judge;
  try {
    some_judge.emplace(device, recordings, options);
  } catch (const Error& error) {
    if (error.fault() != Fault::input || logged.empty()) {
      throw;
    }
    // What is wrong with the logs may be why there are few touches.
    check.findings = logged;
    check.remarks.emplace_back(error.what());
    return check;
  }
  SetupJudge& judge = *some_judge;
  Setup setup{.elements_mm = check.elements_mm};
  double nats = judge.nats(setup);
  check_units(judge, setup, nats, check.findings);
  show(0.1);
  if (at_one_place(judge, setup)) {
    check.remarks.emplace_back(
        "all touches of an object are at nearly one place and angle of the sensor, which tells "
        "nothing of the array: move and turn the sensor between the touches");
  } else {
    check_order(judge, setup, nats, check);
    show(0.3);
    check_offset(judge, setup, nats, check);
    show(0.7);
    check_pitch(judge, setup, nats, check);
  }
  show(0.9);
  check_elements(judge, setup, check);
  check_touches(judge, setup, check);
  check.findings.insert(check.findings.end(), logged.begin(), logged.end());
  return check;
}

}  // namespace palpate
