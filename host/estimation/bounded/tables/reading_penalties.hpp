#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimation/bounded/tables/map_squares.hpp"
#include "palpate/contact_model.hpp"

namespace palpate {

/// Penalties are whole multiples of 1 / penalties_per_nat nats.
inline constexpr double penalties_per_nat = 256.0;
/// The largest penalty of an element; larger ones count as much, which leaves bounds true.
inline constexpr std::uint16_t largest_penalty = 32767;

/// The least penalty of one reading in every square of a map: how much less likely the reading is
/// at least, at any place within the square, than at the map's most likely place.
struct SquarePenalties {
  double best = 0.0;  ///< log-likelihood of the reading at the most likely place, in nats
  int nx = 0;
  int ny = 0;
  std::vector<std::uint16_t> least;  ///< [ny, nx], rounded down
  std::uint16_t beyond = 0;          ///< where the map holds only the prior
};

/// Any likelihood will do: its extremes over the range of a square's log odds are sought, and
/// nothing is taken for monotone.
/// @param contact resolved: with its prior
SquarePenalties square_penalties(const MapSquares& squares, const ContactModel& contact,
                                 Reading reading, std::size_t object);

/// Squares of `count` x `count` squares each; the last of a row or column reach beyond the map.
SquarePenalties merged(const SquarePenalties& squares, int count);

}  // namespace palpate
