#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "learning/fused_map.hpp"
#include "learning/press_groups.hpp"
#include "learning/press_search.hpp"
#include "learning/unposed_maps.hpp"

namespace palpate {

/// A press with all that does not depend on where it lies.
struct UnposedPress {
  std::size_t index = 0;         ///< into the presses given
  std::vector<PressSide> sides;  ///< as it is and, where asked for, mirrored
  PressImage image;              ///< in the robot frame of the first side
};

/// The map that a press is a part of so far, and its place there.
struct PressHome {
  std::optional<std::size_t> map;
  PressPlace place;  ///< on the map, or else on the one that it fits best
  double fit = 0.0;  ///< see PlacedPress::fit; 1 where the map is of this press alone

  ImagePlace image_place() const;
};

/// Assigns presses to maps and places them, as unposed_maps() says.
class PressFusion {
 public:
  /// @param presses, options, progress outlive this object
  /// @param step_mm of the presses' lattices
  PressFusion(std::span<const UnposedPress> presses, const UnposedOptions& options, double step_mm,
              const std::function<void(double)>& progress);

  /// Makes a map of each press.
  void keep_apart();
  /// Makes at most as many maps as the options say. Returns the number of rounds.
  int fuse();

  const std::vector<PressHome>& homes() const { return homes_; }  ///< [press]
  std::size_t maps() const { return maps_.size(); }               ///< some may be of no press
  bool settled() const { return settled_; }                       ///< the last round moved no press
  /// Whether a press's contact gains so little, even on the map of this press alone, that the best
  /// of all the places compared may gain as much by chance.
  bool says_little(std::size_t press) const { return is_little(press, homes_[press].place); }

 private:
  /// A map in the making.
  struct Group {
    FusedMap sums;
    std::size_t presses = 0;
  };

  void report(double fraction) const;
  Hypothesis compared(const FusedMap& map) const;
  Hypothesis alone(std::size_t press) const;
  bool is_little(std::size_t press, const PressPlace& place) const;
  double fit_of(std::size_t press, const PressPlace& place) const;
  std::size_t maps_in_use() const;

  void begin_map(std::size_t press);
  void join(std::size_t press);
  void leave(std::size_t press);

  void compare_single_presses();
  bool open_maps();
  void join_first_maps();
  bool place_all();
  PressHome best_home(std::size_t press, const PressHome& before) const;

  std::span<const UnposedPress> presses_;
  const UnposedOptions& options_;
  double step_mm_;
  const std::function<void(double)>& progress_;
  PressSearch search_;
  std::vector<double> own_gain_;      ///< [press] on the map of this press alone
  std::vector<double> contact_gain_;  ///< [press] the part of its elements In Contact
  std::vector<PressHome> homes_;      ///< [press]
  std::vector<Group> maps_;           ///< those that all presses left keep their index
  FitTable fits_;
  std::vector<std::vector<PressPlace>> single_;  ///< [column][press] on the map of a single press
  std::vector<std::size_t> opened_;              ///< columns of the maps begun since the last round
  bool settled_ = true;
};

}  // namespace palpate
