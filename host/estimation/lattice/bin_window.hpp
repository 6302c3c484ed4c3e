#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace palpate {

/// A block of an object's bins. Its thetas continue at the lattice's first theta after the last;
/// its rows and columns (indices along y and x) lie within the lattice.
struct BinWindow {
  int theta_first = 0;  ///< may be negative
  int theta_count = 0;
  int row_first = 0;
  int row_count = 0;
  int column_first = 0;
  int column_count = 0;

  std::size_t rows() const { return static_cast<std::size_t>(theta_count) * row_count; }
  std::size_t bins() const { return rows() * column_count; }
};

/// The log-likelihoods of one object's bins in windows, one window after another, each [theta, y,
/// x], in nats: read from a dense belief or evaluated on demand.
using WindowLogLikelihood = std::function<std::vector<double>(std::span<const BinWindow>)>;

}  // namespace palpate
