#include "learning/unposed_maps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "learning/observed_map.hpp"
#include "learning/press_placement.hpp"
#include "learning/progress.hpp"
#include "model/element_spacing.hpp"
#include "model/refuse.hpp"

namespace palpate {

namespace {

/// A press with all that does not depend on where it lies.
struct UnposedPress {
  std::size_t index = 0;         ///< into the presses given
  std::vector<PressSide> sides;  ///< as it is and, where asked for, mirrored
  OccupancyGrid image;           ///< observed_map(), in the robot frame of the first side
};

double largest_reach_mm(std::span<const UnposedPress> presses) {
  double reach_mm = 0.0;
  for (const UnposedPress& press : presses) {
    reach_mm = std::max(reach_mm, press.sides.front().reach_mm);
  }
  return reach_mm;
}

/// The map that a press is a part of, and its place there.
struct PressHome {
  std::optional<std::size_t> map;
  PressPlace place;  ///< on the map, or else on the one that it fits best
  double fit = 0.0;  ///< see PlacedPress::fit; 1 where the map is of this press alone

  double weight() const {
    constexpr double least = 0.01;  // of a press whose place is anyone's guess
    return std::max(place.certainty, least);
  }
  ImagePlace image_place() const { return {place.T_object_robot, place.mirrored, weight()}; }
};

/// Comparisons of a press with the map of a single press: bounds the time that many presses take.
constexpr std::size_t most_comparisons = 1500;
constexpr std::size_t fewest_columns = 8;

/// Maps and presses on their way to each other.
class PressFusion {
 public:
  PressFusion(std::span<const UnposedPress> presses, const UnposedOptions& options, double step_mm,
              const std::function<void(double)>& progress)
      : presses_(presses),
        options_(options),
        step_mm_(step_mm),
        report_(Progress(1.0, progress).part(1.0)),
        search_(options.contact, step_mm, largest_reach_mm(presses), options.temperature),
        own_gain_(presses.size()),
        contact_gain_(presses.size()),
        homes_(presses.size()) {
    tbb::parallel_for(std::size_t{0}, presses.size(), [&](std::size_t p) {
      const PressSide& press = presses_[p].sides.front();
      const Hypothesis own = single_map(p);
      own_gain_[p] = search_.gain(press.evidence, own, {});
      contact_gain_[p] = search_.gain(press.contact, own, {});
    });
  }

  /// Makes a map of each press, or at most as many as the options say.
  void run() {
    if (presses_.size() <= options_.most_maps) {
      for (std::size_t p = 0; p < presses_.size(); ++p) {
        begin_map(p);
      }
      return;
    }
    compare_single_presses();
    open_maps();
    join_first_maps();
    constexpr int most_rounds = 8;
    settled_ = false;
    while (!settled_ && rounds_ < most_rounds) {
      settled_ = !place_all();
      ++rounds_;
      report_(0.5 + 0.5 * rounds_ / most_rounds);
      // Later maps would leave their presses no time to settle.
      if (rounds_ < most_rounds / 2 && open_maps()) {
        settled_ = false;
      }
    }
  }

  UnposedMaps result(const std::string& label) const {
    UnposedMaps result{.rounds = rounds_, .settled = settled_};
    for (std::size_t p = 0; p < presses_.size(); ++p) {
      if (const PressHome& home = homes_[p]; !home.map) {
        result.misfits.push_back(
            {presses_[p].index, is_little(p, home.place)
                                    ? "too little is in contact"
                                    : fmt::format("fits no map ({:.2f})", home.fit)});
      }
    }
    for (std::size_t map = 0; map < maps_.size(); ++map) {
      if (maps_[map].presses > 0) {
        result.maps.push_back(final_map(map, label));
      }
    }
    std::ranges::stable_sort(result.maps, std::ranges::greater{},
                             [](const UnposedMap& map) { return map.presses.size(); });
    return result;
  }

 private:
  /// A map in the making.
  struct Group {
    MapSums sums;
    std::size_t presses = 0;
  };

  /// A map of some press. Images are computed at their places.
  UnposedMap final_map(std::size_t map, const std::string& label) const {
    UnposedMap result;
    MapSums sums(options_.map);
    for (std::size_t p = 0; p < presses_.size(); ++p) {
      const PressHome& home = homes_[p];
      if (home.map != map) {
        continue;
      }
      Touch touch = presses_[p].sides[home.place.mirrored ? 1 : 0].touch;
      touch.T_robot_sensor = home.place.T_object_robot * touch.T_robot_sensor;
      sums.add(observed_map(std::span(&touch, 1), options_.map, label), {.weight = home.weight()});
      result.presses.push_back({.press = presses_[p].index,
                                .T_object_sensor = touch.T_robot_sensor,
                                .mirrored = home.place.mirrored,
                                .weight = home.weight(),
                                .fit = home.fit});
    }
    if (result.presses.size() == 1) {
      result.presses.front().fit = {};
    }
    result.map = sums.mean(label);
    result.map.mirror = options_.mirror;
    return result;
  }

  Hypothesis compared(const MapSums& map) const {
    Hypothesis result{.map = map.mean("")};
    if (options_.layer) {
      result.layer = reading_layer(result.map, *options_.layer);
    }
    return result;
  }

  /// The map of one press, in the press's robot frame.
  Hypothesis single_map(std::size_t press) const {
    MapSums map(options_.map);
    map.add(presses_[press].image, {});
    return compared(map);
  }

  bool is_little(std::size_t press, const PressPlace& place) const {
    return contact_gain_[press] <= place.log_places || own_gain_[press] <= 0.0;
  }

  double fit_of(std::size_t press, const PressPlace& place) const {
    return is_little(press, place) ? 0.0 : std::max(0.0, place.gain / own_gain_[press]);
  }

  void begin_map(std::size_t press) {
    homes_[press] = {.map = maps_.size(), .place = {.certainty = 1.0}, .fit = 1.0};
    maps_.push_back({MapSums(options_.map), 0});
    join(press);
  }

  void join(std::size_t press) {
    const PressHome& home = homes_[press];
    if (home.map) {
      maps_[*home.map].sums.add(presses_[press].image, home.image_place());
      ++maps_[*home.map].presses;
    }
  }

  void leave(std::size_t press) {
    PressHome& home = homes_[press];
    if (home.map) {
      maps_[*home.map].sums.remove(presses_[press].image, home.image_place());
      --maps_[*home.map].presses;
      home.map = {};
    }
  }

  void compare_single_presses() {
    const std::size_t n = presses_.size();
    const std::size_t columns = std::min(n, std::max(fewest_columns, most_comparisons / n));
    fits_.fit.assign(n, std::vector<double>(columns, 0.0));
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t of = c * n / columns;
      fits_.columns.push_back(of);
      const Hypothesis map = single_map(of);
      single_.emplace_back(n);
      tbb::parallel_for(std::size_t{0}, n, [&](std::size_t p) {
        single_.back()[p] = search_.best_place(presses_[p].sides, map);
      });
      for (std::size_t p = 0; p < n; ++p) {
        fits_.fit[p][c] = p == of ? 1.0 : fit_of(p, single_.back()[p]);
      }
      report_(0.5 * static_cast<double>(c + 1) / static_cast<double>(columns));
    }
  }

  /// Begins maps with presses that fit none, while there may be more. Returns whether it did.
  bool open_maps() {
    bool opened = false;
    const auto in_use = [](const Group& map) { return map.presses > 0; };
    while (static_cast<std::size_t>(std::ranges::count_if(maps_, in_use)) < options_.most_maps) {
      std::vector<double> best;
      for (std::size_t p = 0; p < presses_.size(); ++p) {
        best.push_back(homes_[p].map ? homes_[p].fit : 0.0);
        for (const std::size_t column : opened_) {
          best.back() = std::max(best.back(), fits_.fit[p][column]);
        }
      }
      const std::optional<std::size_t> next = next_map(fits_, best, good_fit);
      if (!next) {
        break;
      }
      leave(fits_.columns[*next]);
      begin_map(fits_.columns[*next]);
      opened_.push_back(*next);
      opened = true;
    }
    return opened;
  }

  /// Places the presses that began no map where they fit the first press of one.
  void join_first_maps() {
    for (std::size_t p = 0; p < presses_.size(); ++p) {
      if (homes_[p].map) {
        continue;
      }
      for (std::size_t map = 0; map < opened_.size(); ++map) {
        const std::size_t column = opened_[map];
        if (fits_.fit[p][column] >= std::max(homes_[p].fit, least_fit)) {
          homes_[p] = {.map = map, .place = single_[column][p], .fit = fits_.fit[p][column]};
        }
      }
      join(p);
    }
  }

  /// Where the press fits best, of all maps; without a map where it fits none well enough. It stays
  /// where it was unless another place is clearly better, so that presses of an object that looks
  /// the same after a turn or a shift come to rest.
  PressHome best_home(std::size_t press, const PressHome& before) const {
    const double clear_gain = 0.1 * options_.temperature;
    const std::vector<PressSide>& sides = presses_[press].sides;
    PressHome best;
    for (std::size_t map = 0; map < maps_.size(); ++map) {
      if (maps_[map].presses == 0) {
        continue;
      }
      const Hypothesis hypothesis = compared(maps_[map].sums);
      PressPlace place = search_.best_place(sides, hypothesis);
      if (before.map == map && before.place.mirrored == place.mirrored) {
        const double gain = search_.gain(sides[place.mirrored ? 1 : 0].evidence, hypothesis,
                                         before.place.T_object_robot);
        if (gain > place.gain - clear_gain) {
          place.T_object_robot = before.place.T_object_robot;
          place.gain = gain;
        }
      }
      if (const double fit = fit_of(press, place); fit > best.fit || !best.map) {
        best = {.map = map, .place = place, .fit = fit};
      }
    }
    if (best.fit < least_fit) {
      best.map = {};
    }
    return best;
  }

  /// Takes each press out of its map and places it anew. Returns whether any press changed its map
  /// or moved.
  bool place_all() {
    opened_.clear();
    bool changed = false;
    for (std::size_t p = 0; p < presses_.size(); ++p) {
      const PressHome before = homes_[p];
      const bool only_one_there = before.map && maps_[*before.map].presses == 1;
      leave(p);
      const PressHome best = best_home(p, before);
      homes_[p] = only_one_there && best.fit < good_fit ? before : best;
      join(p);
      const PressHome& now = homes_[p];
      const PressSide& side = presses_[p].sides[now.place.mirrored ? 1 : 0];
      const bool stayed =
          now.map == before.map &&
          (!now.map || (now.place.mirrored == before.place.mirrored &&
                        displacement_mm(side, now.place.T_object_robot,
                                        before.place.T_object_robot) <= step_mm_ / 4.0));
      changed = changed || !stayed;
    }
    return changed;
  }

  std::span<const UnposedPress> presses_;
  const UnposedOptions& options_;
  double step_mm_;
  std::function<void(double)> report_;
  PressSearch search_;
  std::vector<double> own_gain_;      ///< [press] on the map of this press alone
  std::vector<double> contact_gain_;  ///< [press] the part of own_gain_ of its elements In Contact
  std::vector<PressHome> homes_;      ///< [press]
  std::vector<Group> maps_;           ///< a map that all presses left keeps its index
  FitTable fits_;
  std::vector<std::vector<PressPlace>> single_;  ///< [column][press] on the map of a single press
  std::vector<std::size_t> opened_;              ///< columns of the maps begun since the last round
  int rounds_ = 0;
  bool settled_ = true;
};

}  // namespace

std::optional<std::size_t> next_map(const FitTable& table, std::span<const double> best,
                                    double enough) {
  std::optional<std::size_t> next;
  double largest = 0.0;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    if (best[table.columns[c]] >= enough) {
      continue;
    }
    double gain = 0.0;
    for (std::size_t p = 0; p < best.size(); ++p) {
      gain += std::max(0.0, std::clamp(table.fit[p][c], 0.0, 1.0) - best[p]);
    }
    if (gain > largest) {
      largest = gain;
      next = c;
    }
  }
  return next;
}

double element_pitch_mm(std::span<const Touch> presses) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (i == 0 || presses[i].elements_mm.data() != presses[i - 1].elements_mm.data()) {
      least = std::min(least, pitch_of(presses[i].elements_mm).value_or(least));
    }
  }
  if (!std::isfinite(least)) {
    throw Error(Fault::input, "presses at unknown poses need an array of several elements");
  }
  return least;
}

UnposedMaps unposed_maps(std::span<const Touch> presses, const std::string& label,
                         const UnposedOptions& options,
                         const std::function<void(double)>& progress) {
  const double step_mm = element_pitch_mm(presses);
  std::vector<Misfit> untouched;
  std::vector<UnposedPress> placeable;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    UnposedPress press{.index = i, .sides = {}, .image = {}};
    press.sides.emplace_back(presses[i], options.contact, false);
    if (options.mirror) {
      press.sides.emplace_back(presses[i], options.contact, true);
    }
    if (press.sides.front().evidence.front().in_contact()) {
      placeable.push_back(std::move(press));
    } else {
      untouched.push_back({i, "nothing is in contact"});
    }
  }
  if (placeable.empty()) {
    refuse(fmt::format("object '{}'", label),
           "no press has an element In Contact; check the threshold and the pressure's unit");
  }
  tbb::parallel_for(std::size_t{0}, placeable.size(), [&](std::size_t p) {
    placeable[p].image =
        observed_map(std::span(&placeable[p].sides.front().touch, 1), options.map, label);
  });
  PressFusion fusion(placeable, options, step_mm, progress);
  fusion.run();
  UnposedMaps made = fusion.result(label);
  made.misfits.insert(made.misfits.end(), untouched.begin(), untouched.end());
  std::ranges::sort(made.misfits, {}, &Misfit::press);
  return made;
}

}  // namespace palpate
