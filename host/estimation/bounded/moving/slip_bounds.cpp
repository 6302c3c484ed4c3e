#include <algorithm>
#include <cmath>
#include <limits>

#include "estimation/bounded/displaced/blurred_plane.hpp"
#include "estimation/bounded/moving/slip_mean.hpp"
#include "estimation/parallel_for.hpp"

// Upper bounds of the means of a belief that slips, over tiles.

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int side = BlockRun::side;

/// The part of a place's two neighbours along an axis that lies inside the region.
double weight_inside(double place, int count) {
  return std::clamp(std::min(place + 1.0, count - place), 0.0, 1.0);
}

}  // namespace

void SlipMean::find_sources() {
  for (int k = -weights_.theta_steps(); k <= weights_.theta_steps(); ++k) {
    std::vector<TileSource>& sources = sources_.emplace_back();
    for (int py = 0; py < rows(); ++py) {
      for (int px = 0; px < columns(); ++px) {
        // Without a turn, a tile's bins stay where they are.
        sources.push_back(k == 0 ? TileSource{px, px + 1, py, py + 1, 1.0 - 1e-6}
                                 : source_of(px, py, turns_[sources_.size() - 1]));
      }
    }
  }
}

std::vector<double> SlipMean::bounds(std::span<const double> log_bounds) const {
  const int width = columns();
  const int height = rows();
  std::vector<BlockRun> targets;
  for (int theta = 0; theta < static_cast<int>(taps_.size()); ++theta) {
    for (int y = 0; side * y < height; ++y) {
      targets.push_back({theta, y, 0, (width + side - 1) / side});
    }
  }
  const double largest = *std::ranges::max_element(log_bounds);
  std::vector<float> relative;
  for (const double log : log_bounds) {
    relative.push_back(std::nextafter(static_cast<float>(std::max(log - largest, -1e30)), 1.0F));
  }
  const std::vector<BlurredPlane<TileLikelihoods>> planes =
      blurred<TileLikelihoods, float>(targets, relative);
  // Each term rounds by a few units, and so do exponentials and the logarithm.
  constexpr double rounding = 2e-3;
  const std::size_t tiles = static_cast<std::size_t>(width) * height;
  std::vector<double> means(log_bounds.size());
  parallel_for(taps_.size(), [&](std::size_t theta) {
    double reference = -infinity;
    for (const Tap& tap : taps_[theta]) {
      reference = std::max(reference, planes[tap.theta].reference);
    }
    std::vector<float> sum(tiles);
    std::vector<double> inside(tiles);
    for (const Tap& tap : taps_[theta]) {
      const BlurredPlane<TileLikelihoods>& plane = planes[tap.theta];
      const std::vector<TileSource>& sources = sources_[index_of(tap)];
      const auto weight = static_cast<float>(tap.weight * std::exp(plane.reference - reference));
      for (std::size_t tile = 0; tile < tiles; ++tile) {
        const TileSource& source = sources[tile];
        inside[tile] += tap.weight * source.inside;
        float largest_there = 0.0F;
        for (int y = source.y_first; y < source.y_end; ++y) {
          const float* const row = plane.blurred.data() + (y - plane.y) * plane.pitch - plane.x;
          for (int x = source.x_first; x < source.x_end; ++x) {
            largest_there = std::max(largest_there, row[x]);
          }
        }
        sum[tile] += weight * largest_there;
      }
    }
    for (std::size_t tile = 0; tile < tiles; ++tile) {
      means[theta * tiles + tile] =
          TileLikelihoods::log_mean(sum[tile], inside[tile]) + reference + largest + rounding;
    }
  });
  return means;
}

SlipMean::TileSource SlipMean::source_of(int px, int py, const Turn& turned) const {
  const Axis& x_mm = weights_.lattice().x_mm;
  const Axis& y_mm = weights_.lattice().y_mm;
  const auto [least, most] = moved(
      turned, {px * bins_, py * bins_},
      {std::min((px + 1) * bins_, x_mm.count) - 1, std::min((py + 1) * bins_, y_mm.count) - 1});
  const auto least_inside = [](double low, double high, int count) {
    return std::min(weight_inside(low, count), weight_inside(high, count));
  };
  const auto tile = [&](double bin, int tiles) {
    return static_cast<int>(std::clamp<double>(std::floor(bin / bins_), -1, tiles));
  };
  const double inside = least_inside(least.x, most.x, x_mm.count) *
                        least_inside(least.y, most.y, y_mm.count) * (1.0 - 1e-6);
  // A little more, for rounding.
  return {.x_first = std::max(0, tile(std::floor(least.x - 1e-9), columns())),
          .x_end = std::min(columns(), tile(std::ceil(most.x + 1e-9), columns()) + 1),
          .y_first = std::max(0, tile(std::floor(least.y - 1e-9), rows())),
          .y_end = std::min(rows(), tile(std::ceil(most.y + 1e-9), rows()) + 1),
          .inside = inside};
}

}  // namespace palpate
