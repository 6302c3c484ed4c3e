#include "learning/press_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <tbb/parallel_for.h>

namespace palpate {

namespace {

constexpr int most_rounds = 8;
/// Comparisons of a press with the map of a single press: bounds the time that many presses take.
constexpr std::size_t most_comparisons = 1500;
constexpr std::size_t fewest_columns = 8;
/// The weight of a press whose place is anyone's guess.
constexpr double least_weight = 0.01;
/// Label of unfinished maps.
const std::string no_label;

/// Angles at which the lattice moves the presses' contact by about one and a half steps; the search
/// climbs between them.
int angles_for(std::span<const UnposedPress> presses, double step_mm) {
  double reach_mm = 0.0;
  for (const UnposedPress& press : presses) {
    reach_mm = std::max(reach_mm, press.sides.front().reach_mm());
  }
  constexpr int fewest = 24;
  constexpr int most = 48;
  return std::clamp(
      static_cast<int>(std::ceil(2.0 * std::numbers::pi * reach_mm / (1.5 * step_mm))), fewest,
      most);
}

/// Maps and presses on their way to each other.
class PressFusion {
 public:
  PressFusion(std::span<const UnposedPress> presses, const UnposedOptions& options, double step_mm,
              const std::function<void(double)>& progress)
      : presses_(presses),
        options_(options),
        step_mm_(step_mm),
        progress_(progress),
        search_(options.contact, step_mm, angles_for(presses, step_mm), options.temperature),
        own_gain_(presses.size()),
        contact_gain_(presses.size()),
        homes_(presses.size()) {
    tbb::parallel_for(std::size_t{0}, presses.size(), [&](std::size_t p) {
      const PressSide& press = presses_[p].sides.front();
      const Hypothesis own = alone(p);
      own_gain_[p] = search_.gain(press.evidence(), own, {});
      contact_gain_[p] = search_.gain(press.contact(), own, {});
    });
  }

  /// Makes a map of each press.
  FusedPresses keep_apart() {
    for (std::size_t p = 0; p < presses_.size(); ++p) {
      begin_map(p);
    }
    return fused(0, true);
  }

  /// Makes at most as many maps as the options say.
  FusedPresses fuse() {
    compare_single_presses();
    open_maps();
    join_first_maps();
    bool settled = false;
    int round = 0;
    while (!settled && round < most_rounds) {
      settled = !place_all();
      ++round;
      report(0.5 + 0.5 * round / most_rounds);
      // Later maps would leave their presses no time to settle.
      if (round < most_rounds / 2 && open_maps()) {
        settled = false;
      }
    }
    return fused(round, settled);
  }

 private:
  /// A map in the making.
  struct Group {
    FusedMap sums;
    std::size_t presses = 0;
  };

  FusedPresses fused(int rounds, bool settled) const {
    FusedPresses result{
        .homes = homes_, .maps = maps_.size(), .rounds = rounds, .settled = settled};
    for (std::size_t p = 0; p < presses_.size(); ++p) {
      result.homes[p].too_little_contact = is_little(p, homes_[p].place);
    }
    return result;
  }

  void report(double fraction) const {
    if (progress_) {
      progress_(fraction);
    }
  }

  Hypothesis compared(const FusedMap& map) const {
    Hypothesis result{.map = map.map(no_label)};
    if (options_.layer) {
      result.layer = reading_layer(result.map, *options_.layer);
    }
    return result;
  }

  /// The map of one press, in the press's robot frame.
  Hypothesis alone(std::size_t press) const {
    FusedMap map(options_.map);
    map.add(presses_[press].image, {});
    return compared(map);
  }

  bool is_little(std::size_t press, const PressPlace& place) const {
    return contact_gain_[press] <= place.log_places || own_gain_[press] <= 0.0;
  }

  double fit_of(std::size_t press, const PressPlace& place) const {
    return is_little(press, place) ? 0.0 : std::max(0.0, place.gain / own_gain_[press]);
  }

  std::size_t maps_in_use() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(maps_, [](const Group& map) { return map.presses > 0; }));
  }

  void begin_map(std::size_t press) {
    homes_[press] = {.map = maps_.size(), .place = {.certainty = 1.0}, .fit = 1.0};
    maps_.push_back({FusedMap(options_.map), 0});
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
      const Hypothesis map = alone(of);
      single_.emplace_back(n);
      tbb::parallel_for(std::size_t{0}, n, [&](std::size_t p) {
        single_.back()[p] = search_.best_place(presses_[p].sides, map);
      });
      for (std::size_t p = 0; p < n; ++p) {
        fits_.fit[p][c] = p == of ? 1.0 : fit_of(p, single_.back()[p]);
      }
      report(0.5 * static_cast<double>(c + 1) / static_cast<double>(columns));
    }
  }

  /// Begins maps with presses that fit none, while there may be more. Returns whether it did.
  bool open_maps() {
    bool opened = false;
    while (maps_in_use() < options_.most_maps) {
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
        const double gain = search_.gain(sides[place.mirrored ? 1 : 0].evidence(), hypothesis,
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
      const bool alone_there = before.map && maps_[*before.map].presses == 1;
      leave(p);
      const PressHome best = best_home(p, before);
      homes_[p] = alone_there && best.fit < good_fit ? before : best;
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
  const std::function<void(double)>& progress_;
  PressSearch search_;
  std::vector<double> own_gain_;      ///< [press] on the map of this press alone
  std::vector<double> contact_gain_;  ///< [press] the part of own_gain_ of its elements In Contact
  std::vector<PressHome> homes_;      ///< [press]
  std::vector<Group> maps_;           ///< a map that all presses left keeps its index
  FitTable fits_;
  std::vector<std::vector<PressPlace>> single_;  ///< [column][press] on the map of a single press
  std::vector<std::size_t> opened_;              ///< columns of the maps begun since the last round
};

}  // namespace

ImagePlace PressHome::image_place() const {
  return {place.T_object_robot, place.mirrored, std::max(place.certainty, least_weight)};
}

FusedPresses fuse_presses(std::span<const UnposedPress> presses, const UnposedOptions& options,
                          double step_mm, const std::function<void(double)>& progress) {
  PressFusion fusion(presses, options, step_mm, progress);
  return presses.size() <= options.most_maps ? fusion.keep_apart() : fusion.fuse();
}

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

}  // namespace palpate
