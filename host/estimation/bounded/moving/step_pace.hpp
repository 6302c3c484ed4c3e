#pragma once

#include <array>
#include <cstddef>

namespace palpate {

/// How many tiles a touch may follow in the time that is left, by how long earlier touches took.
/// Touches before and after a slip have paces of their own.
class StepPace {
 public:
  /// Takes note that a touch followed so many tiles.
  void note(bool slips, std::size_t followed, double seconds);
  /// @param left_s until a deadline, of which the touch may take a part: the first ones follow the
  /// most tiles
  double tiles_within(bool slips, double left_s) const;

 private:
  struct Step {
    double tiles = 0.0;  ///< 0 where there was no such step
    double seconds = 0.0;
  };
  /// What tells the time that a touch takes whatever it follows from the time of a tile.
  struct Pace {
    Step fewest;
    Step most;
  };

  std::array<Pace, 2> paces_{};  ///< [slips]
};

}  // namespace palpate
