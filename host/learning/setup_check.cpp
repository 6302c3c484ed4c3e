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

#include "learning/press.hpp"
#include "learning/progress.hpp"
#include "learning/setup_judge.hpp"
#include "model/bounding_box.hpp"
#include "model/map_likelihood.hpp"
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

/// Metres, degrees or both, where the numbers allow for it.
std::vector<PoseUnit> possible_units(const SetupJudge& judge, const Setup& setup) {
  constexpr double circle = 2.0 * std::numbers::pi;
  BoundingBox places;
  double most_angle = 0.0;
  for (const auto& [object, touches] : judge.touches()) {
    for (const TriedTouch& given : touches) {
      places.take_in(given.touch.T_robot_sensor.translation_mm);
      most_angle = std::max(most_angle, std::abs(given.touch.T_robot_sensor.theta_rad));
    }
  }
  const bool may_be_metres = places.diagonal() < 0.1 * array_reach_mm(setup.elements_mm);
  const bool may_be_degrees = most_angle > circle;
  // An angle that counts turns exceeds a circle in radians, too.
  std::vector<PoseUnit> units;
  if (may_be_metres && may_be_degrees) {
    units.push_back({true, true});
  }
  if (may_be_metres) {
    units.push_back({true, false});
  }
  if (may_be_degrees) {
    units.push_back({false, true});
  }
  return units;
}

SetupFinding unit_finding(const PoseUnit& unit, double nats) {
  const std::string option =
      fmt::format("pose-unit {},{}", unit.metres ? "m" : "mm", unit.degrees ? "deg" : "rad");
  return {"pose_unit",
          nats,
          fmt::format("the sensor's poses are in {}: import them with `{}`",
                      unit.metres && unit.degrees ? "metres and degrees"
                      : unit.metres               ? "metres"
                                                  : "degrees",
                      option),
          {option}};
}

/// Poses in degrees or metres.
void check_units(SetupJudge& judge, Setup& setup, double& nats,
                 std::vector<SetupFinding>& findings) {
  std::optional<PoseUnit> best;
  double gain = least_nats;
  for (const PoseUnit& unit : possible_units(judge, setup)) {
    if (const double gained = judge.nats(unit.of(setup)) - nats; gained > gain) {
      best = unit;
      gain = gained;
    }
  }
  if (best) {
    findings.push_back(unit_finding(*best, gain));
    setup = best->of(setup);
    nats += gain;
  }
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

/// The array anywhere in the tool, in every unit and order that a turn of the array does not make.
void search_widely(SetupJudge& judge, Setup& setup, SetupCheck& check) {
  std::vector<PoseUnit> units = possible_units(judge, setup);
  units.insert(units.begin(), PoseUnit());
  const std::vector<ElementOrder> orders = orders_but_for_turns(setup.elements_mm);
  struct Found {
    PoseUnit unit;
    ElementOrder order;
    FoundMount mount;
  };
  std::optional<Found> best;
  for (const PoseUnit& unit : units) {
    for (const ElementOrder& order : orders) {
      Setup tried = unit.of(setup);
      tried.elements_mm = order.elements_mm;
      if (likeness_of_angles(judge, tried.rad) > one_angle) {
        continue;
      }
      const FoundMount mount = search_mount(judge, tried);
      if (!best || mount.nats - best->mount.nats > least_share * std::abs(best->mount.nats)) {
        best = {unit, order, mount};
      }
    }
  }
  if (!best) {
    return;
  }
  const auto placed_best = [&](Setup at) {
    for (glm::dvec2& p : at.elements_mm) {
      p = best->mount.offset * p;
    }
    return judge.nats(at);
  };
  Setup found = best->unit.of(setup);
  found.elements_mm = best->order.elements_mm;
  double nats = placed_best(found);
  if (best->unit.metres || best->unit.degrees) {
    Setup as_given = setup;
    as_given.elements_mm = found.elements_mm;
    check.findings.push_back(unit_finding(best->unit, nats - placed_best(as_given)));
  }
  if (!best->order.options.empty()) {
    Setup as_given = found;
    as_given.elements_mm = setup.elements_mm;
    check.findings.push_back(order_finding(best->order.options, nats - placed_best(as_given)));
  }
  setup = found;
  nats = judge.nats(setup);
  check_offset(judge, setup, nats, check, best->mount.offset);
  check_pitch(judge, setup, nats, check);
}

SetupFinding unexplained(const SetupFit& fit) {
  return {"unexplained", 0.0,
          fmt::format("nothing that was tried explains these touches: {} of {} do not fit the map "
                      "of the others; look at the clock of the poses (`pose-delay`), whether "
                      "every pose is that of its touch, at the signs of x, y and the angle, where "
                      "the array is mounted, and whether an object moved or was changed",
                      fit.misfits, fit.touches)};
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
    const MapLikelihood likelihood(map, judge.contact());
    for (std::size_t e = 0; e < given.readings.size(); ++e) {
      if (given.readings[e] == Reading::unknown) {
        continue;
      }
      const glm::dvec2 p = touch.T_robot_sensor * touch.elements_mm[e];
      const double yes = likelihood.at(Reading::in_contact, p);
      const double no = likelihood.at(Reading::no_contact, p);
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
void check_touches(SetupJudge& judge, Setup& setup, SetupCheck& check) {
  constexpr double least_z = -6.0;
  std::map<std::string, std::vector<std::size_t>> found;
  double nats = 0.0;
  std::set<const TriedTouch*> left_out;
  judge.visit(setup, [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
    const std::optional<Fit> fit = fit_of({&touch, 1}, {}, map, judge.contact());
    if (fit && fit->z < least_z) {
      found[given.recording].push_back(given.index);
      nats -= fit->z;
      left_out.insert(&given);
    }
    check.touches += 1;
  });
  if (left_out.empty() || 4 * left_out.size() > check.touches) {  // so many are the set-up's
    return;
  }
  setup.left_out = std::move(left_out);
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
Recording thinned(const Recording& recording, std::size_t limit) {
  ObjectTouches few{recording.object, {}};
  const std::size_t every = (recording.size() + limit - 1) / limit;
  for (std::size_t i = 0; i < recording.size(); i += every) {
    few.touches.push_back(recording.touch(i));
  }
  return gathered(few, recording.pressure_unit);
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
  SetupCheck check;
  Setup setup{.elements_mm = few.front().elements_mm};
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
  const auto show = Progress(1.0, progress).part(1.0);
  const Setup given{.elements_mm = recordings.front().elements_mm};
  SetupCheck check{.elements_mm = given.elements_mm};
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
  Setup setup = given;
  SetupFit fit;
  const auto judged = [&] {
    check_elements(judge, setup, check);
    check_touches(judge, setup, check);
    fit = judge.fit(setup);
    return fit.is_sound(!check.findings.empty());
  };
  double nats = judge.nats(setup);
  check_units(judge, setup, nats, check.findings);
  show(0.1);
  const bool moved = !at_one_place(judge, setup);
  if (!moved) {
    check.remarks.emplace_back(
        "all touches of an object are at nearly one place and angle of the sensor, which tells "
        "nothing of the array: move and turn the sensor between the touches");
  } else {
    check_order(judge, setup, nats, check);
    show(0.2);
    check_offset(judge, setup, nats, check);
    show(0.4);
    check_pitch(judge, setup, nats, check);
  }
  show(0.5);
  if (!judged() && moved) {
    check = {.remarks = std::move(check.remarks)};
    setup = given;
    search_widely(judge, setup, check);
    show(0.9);
    if (!judged()) {
      check = {.findings = {unexplained(fit)},
               .remarks = std::move(check.remarks),
               .touches = check.touches};
      setup = given;
    }
  }
  check.elements_mm = setup.elements_mm;
  check.findings.insert(check.findings.end(), logged.begin(), logged.end());
  return check;
}

}  // namespace palpate
