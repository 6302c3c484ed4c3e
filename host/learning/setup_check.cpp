#include "learning/setup_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "learning/progress.hpp"
#include "learning/setup_judge.hpp"
#include "model/angle_unit.hpp"
#include "model/bounding_box.hpp"
#include "model/map_likelihood.hpp"
#include "model/refuse.hpp"
#include "palpate/fit.hpp"

namespace palpate {

namespace {

/// The set-up with poses in metres, degrees or both, where the numbers allow for it.
std::vector<Setup> in_other_units(const SetupJudge& judge, const Setup& setup) {
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
  std::vector<Setup> others;
  for (const auto& [metres, degrees] : {std::pair{true, true}, {true, false}, {false, true}}) {
    if ((!metres || may_be_metres) && (!degrees || may_be_degrees)) {
      others.push_back(setup);
      others.back().mm = metres ? 1000.0 : 1.0;
      others.back().rad = degrees ? radians(1.0) : 1.0;
    }
  }
  return others;
}

/// Poses in degrees or metres.
void check_units(SetupSearch& search) {
  std::optional<Setup> best;
  double gain = least_nats;
  for (const Setup& other : in_other_units(search.judge, search.setup)) {
    const double gained = search.judge.nats(other) - search.nats;
    if (gained > gain) {
      best = other;
      gain = gained;
    }
  }
  if (!best) {
    return;
  }
  const bool metres = best->mm != 1.0;
  const bool degrees = best->rad != 1.0;
  const std::string option =
      fmt::format("pose-unit {},{}", metres ? "m" : "mm", degrees ? "deg" : "rad");
  search.check.findings.push_back(
      {"pose_unit",
       gain,
       fmt::format("the sensor's poses are in {}{}{}: import them with `{}`",
                   metres ? "metres" : "", metres && degrees ? " and " : "",
                   degrees ? "degrees" : "", option),
       {option}});
  search.setup = *best;
  search.nats += gain;
}

/// Whether the touches are, but for a part of the array's reach, at one place and angle. Any array
/// then makes a map of its own that explains them.
bool at_one_place(const SetupJudge& judge, const Setup& setup) {
  constexpr double part = 0.5;
  double widest_mm = 0.0;
  for (const auto& [object, touches] : judge.touches()) {
    BoundingBox places;
    for (const TriedTouch& given : touches) {
      places.take_in(setup.pose_of(given).translation_mm);
    }
    widest_mm = std::max(widest_mm, places.diagonal());
  }
  return widest_mm < part * array_reach_mm(setup.elements_mm) && at_one_angle(judge, setup.rad);
}

/// The best mount of the array anywhere in the tool, in every unit and order that a turn of the
/// array does not make; none where all touches are at one angle.
std::optional<Pose> mount_found_widely(const SetupJudge& judge, const Setup& setup,
                                       const std::function<void(double)>& progress) {
  std::vector<Setup> units = in_other_units(judge, setup);
  units.insert(units.begin(), setup);
  const std::vector<ElementOrder> orders = orders_but_for_turns(setup.elements_mm);
  Progress work(static_cast<double>(units.size() * orders.size()), progress);
  std::optional<Summit<Pose>> best;
  for (Setup& tried : units) {
    for (const ElementOrder& order : orders) {
      tried.elements_mm = order.elements_mm;
      if (!at_one_angle(judge, tried.rad)) {
        const Summit<Pose> found = search_mount(judge, tried);
        if (!best || found.value - best->value > least_share * std::abs(best->value)) {
          best = found;
        }
      }
      work.add();
    }
  }
  return best ? std::optional(best->place) : std::nullopt;
}

/// Elements that always, or never, read contact, against what their places predict.
void check_elements(SetupSearch& search) {
  Setup& setup = search.setup;
  struct Element {
    std::size_t contacts = 0;
    std::size_t known = 0;
    double surprise = 0.0;  ///< above what is expected, in nats
  };
  std::vector<Element> elements(setup.elements_mm.size());
  const auto add = [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
    const MapLikelihood likelihood(map, search.judge.contact());
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
  };
  search.judge.visit(setup, add);
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
      search.check.findings.push_back(
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
void check_touches(SetupSearch& search) {
  constexpr double least_z = -6.0;
  std::map<std::string, std::vector<std::size_t>> found;
  double nats = 0.0;
  std::set<const TriedTouch*> left_out;
  const auto judged = [&](const TriedTouch& given, const Touch& touch, const OccupancyGrid& map) {
    const std::optional<Fit> fit = fit_of({&touch, 1}, {}, map, search.judge.contact());
    if (fit && fit->z < least_z) {
      found[given.recording].push_back(given.index);
      nats -= fit->z;
      left_out.insert(&given);
    }
    search.check.touches += 1;
  };
  search.judge.visit(search.setup, judged);
  if (left_out.empty() || 4 * left_out.size() > search.check.touches) {  // so many are the set-up's
    return;
  }
  search.setup.left_out = std::move(left_out);
  for (auto& [recording, indices] : found) {
    std::ranges::sort(indices);
    search.check.findings.push_back(
        {"contradicting", nats,
         fmt::format("{}: touches that contradict the others: {}; the object moved, or their poses "
                     "are others: leave them out",
                     recording, fmt::join(indices, ", "))});
  }
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

/// What is found in a search that begins at a set-up, and how the touches fit in the one it ends
/// at.
struct CheckedSetup {
  SetupCheck check;
  SetupFit fit;
  bool one_place = false;  ///< see at_one_place(), in the unit that was found

  bool is_sound() const { return fit.is_sound(!check.findings.empty()); }
};

CheckedSetup checked(SetupJudge& judge, const Setup& setup,
                     const std::function<void(double)>& progress) {
  Progress work(5.0, progress);
  SetupSearch search{judge, setup};
  check_units(search);
  work.add();
  const bool one_place = at_one_place(judge, search.setup);
  if (one_place) {
    search.check.remarks.emplace_back(
        "all touches of an object are at nearly one place and angle of the sensor, which tells "
        "nothing of the array: move and turn the sensor between the touches");
  } else {
    check_order(search);
    work.add();
    check_offset(search);
    work.add();
    check_pitch(search);
    work.add();
  }
  check_elements(search);
  check_touches(search);
  search.check.elements_mm = search.setup.mounted_mm();
  return {std::move(search.check), judge.fit(search.setup), one_place};
}

SetupCheck checked_widely(SetupJudge& judge, const Setup& given,
                          const std::function<void(double)>& progress) {
  Progress work(3.0, progress);
  CheckedSetup found = checked(judge, given, work.part(1.0));
  if (found.is_sound() || found.one_place) {
    return found.check;
  }
  if (const auto mount = mount_found_widely(judge, given, work.part(1.0))) {
    Setup mounted = given;
    mounted.mount = *mount;
    found = checked(judge, mounted, work.part(1.0));
  }
  if (!found.is_sound()) {
    found.check.findings = {
        {"unexplained", 0.0,
         fmt::format("nothing that was tried explains these touches: {} of {} do not fit the map "
                     "of the others; look at the clock of the poses (`pose-delay`), whether "
                     "every pose is that of its touch, at the signs of x, y and the angle, where "
                     "the array is mounted, and whether an object moved or was changed",
                     found.fit.misfits, found.fit.touches)}};
    found.check.elements_mm = given.elements_mm;
  }
  return found.check;
}

/// Whether all touches of a recording have this array.
bool has_array(const Recording& recording, const std::vector<glm::dvec2>& elements_mm) {
  return elements_mm.size() == recording.elements() && recording.elements_mm == elements_mm;
}

}  // namespace

std::optional<SetupFinding> suspected_order(Device& device, std::span<const Recording> recordings,
                                            const MapOptions& options) {
  constexpr std::size_t most_objects = 3;
  constexpr std::size_t least_touches = 20;
  constexpr std::size_t most_touches = 40;
  const Setup setup{.elements_mm = recordings.front().elements_mm};
  std::vector<const Recording*> few;
  for (const Recording& recording : recordings) {
    if (recording.size() >= least_touches && has_array(recording, setup.elements_mm) &&
        few.size() < most_objects) {
      few.push_back(&recording);
    }
  }
  if (few.empty()) {
    return {};
  }
  std::optional<SetupFinding> found;
  input_fault_of([&] {
    SetupJudge judge(device, few, options, most_touches);
    SetupSearch search{judge, setup};
    if (!at_one_place(judge, setup)) {
      check_order(search);
    }
    if (!search.check.findings.empty()) {
      found = search.check.findings.front();
    }
  });
  return found;
}

SetupCheck check_setup(Device& device, std::span<const Recording> recordings,
                       const MapOptions& options, const std::function<void(double)>& progress) {
  const Setup given{.elements_mm = recordings.front().elements_mm};
  std::vector<const Recording*> all;
  for (const Recording& recording : recordings) {
    all.push_back(&recording);
    if (!has_array(recording, given.elements_mm)) {
      refuse(recording.path,
             "its array is not that of all touches; check recordings of one array that does not "
             "change");
    }
  }
  const std::vector<SetupFinding> logged = findings_of_logs(recordings);
  SetupCheck check{.elements_mm = given.elements_mm};
  std::optional<SetupJudge> judge;
  const auto fault = input_fault_of([&] { judge.emplace(device, all, options); });
  if (!fault) {
    check = checked_widely(*judge, given, progress);
  } else if (logged.empty()) {
    throw Error(Fault::input, *fault);
  } else {  // what is wrong with the logs may be why there are few touches
    check.remarks.push_back(*fault);
  }
  check.findings.insert(check.findings.end(), logged.begin(), logged.end());
  return check;
}

}  // namespace palpate
