#include "estimation/bounded/moving/step_pace.hpp"

#include <algorithm>

namespace palpate {

namespace {

/// Of the time that is left.
constexpr double share_of_touch = 0.5;
/// Of a tile, before any was timed: a slow machine's, [slips].
constexpr std::array<double, 2> first_seconds{1e-5, 1e-4};
/// Numbers of tiles by less than this factor apart do not tell what a tile takes.
constexpr double apart = 1.5;

}  // namespace

void StepPace::note(bool slips, std::size_t followed, double seconds) {
  Pace& pace = paces_[slips ? 1 : 0];
  const Step step{std::max(1.0, static_cast<double>(followed)), seconds};
  if (pace.fewest.tiles == 0.0 || step.tiles <= pace.fewest.tiles) {
    pace.fewest = step;
  }
  if (step.tiles >= pace.most.tiles) {
    pace.most = step;
  }
}

double StepPace::tiles_within(bool slips, double left_s) const {
  const auto& [fewest, most] = paces_[slips ? 1 : 0];
  double of_tile = most.tiles > 0.0 ? most.seconds / most.tiles : first_seconds[slips ? 1 : 0];
  double of_all = 0.0;
  if (most.tiles > apart * fewest.tiles && most.seconds > fewest.seconds) {
    of_tile = (most.seconds - fewest.seconds) / (most.tiles - fewest.tiles);
    of_all = std::max(0.0, fewest.seconds - of_tile * fewest.tiles);
  }
  return std::max(0.0, share_of_touch * left_s - of_all) / of_tile;
}

}  // namespace palpate
