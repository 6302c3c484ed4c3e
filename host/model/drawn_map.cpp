#include "palpate/drawn_map.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "model/bounding_box.hpp"
#include "model/cell_range.hpp"
#include "model/refuse.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

namespace {

/// Spreads beyond which a map ends: with the default share, elements there feel nothing.
constexpr double margin = 4.0;
/// Standard deviations beyond which a pixel is not part of a Gaussian: 6e-7 of it lies there.
constexpr double reach = 5.0;

void require_sound(const std::string& label, const Mask& mask) {
  const std::string source = fmt::format("mask of '{}'", label);
  if (!(mask.pixel_mm >= least_length_mm && mask.pixel_mm <= most_length_mm)) {
    refuse(source, "a pixel = {} mm: give {:g} to {:g} mm", mask.pixel_mm, least_length_mm,
           most_length_mm);
  }
  if (!std::isfinite(mask.origin_mm.x) || !std::isfinite(mask.origin_mm.y)) {
    refuse(source, "origin = {},{} mm: give finite numbers", mask.origin_mm.x, mask.origin_mm.y);
  }
  if (mask.occupied.size() != mask.rows * mask.columns) {
    refuse(source, "{} pixels in {} rows of {}: give rows times columns", mask.occupied.size(),
           mask.rows, mask.columns);
  }
}

/// The outermost corners of the occupied pixels.
BoundingBox occupied_box(const Mask& mask) {
  BoundingBox box;
  for (std::size_t pixel = 0; pixel < mask.occupied.size(); ++pixel) {
    if (mask.occupied[pixel] != 0) {
      const glm::dvec2 centre =
          mask.origin_mm + mask.pixel_mm * glm::dvec2(pixel % mask.columns, pixel / mask.columns);
      box.take_in(centre - mask.pixel_mm / 2.0);
      box.take_in(centre + mask.pixel_mm / 2.0);
    }
  }
  return box;
}

/// How much of the Gaussian about each of a row of cells lies on each of a row of pixels, along one
/// axis.
class Shares {
 public:
  /// @param cell_mm, pixel_mm centres of the first of each
  Shares(std::size_t cells, double cell_mm, double cell_edge_mm, std::size_t pixels,
         double pixel_mm, double pixel_edge_mm, double sd_mm) {
    const auto below = [&](double mm) {
      return 0.5 * std::erfc(-mm / (std::numbers::sqrt2 * sd_mm));
    };
    for (std::size_t cell = 0; cell < cells; ++cell) {
      const double centre = cell_mm + cell_edge_mm * static_cast<double>(cell);
      const auto pixel_at = [&](double mm) {
        const double index = (mm - pixel_mm) / pixel_edge_mm + 0.5;
        return static_cast<std::size_t>(std::clamp(index, 0.0, static_cast<double>(pixels)));
      };
      const std::size_t begin = pixel_at(centre - reach * sd_mm);
      const std::size_t end = std::min(pixel_at(centre + reach * sd_mm) + 1, pixels);
      Cell& one = cells_.emplace_back(Cell{begin, {}});
      for (std::size_t pixel = begin; pixel < end; ++pixel) {
        const double from = pixel_mm + pixel_edge_mm * (static_cast<double>(pixel) - 0.5) - centre;
        one.shares.push_back(static_cast<float>(below(from + pixel_edge_mm) - below(from)));
      }
    }
  }

  float sum(std::size_t cell, const std::uint8_t* pixels) const {
    const Cell& one = cells_[cell];
    float sum = 0.0F;
    for (std::size_t k = 0; k < one.shares.size(); ++k) {
      sum += pixels[one.begin + k] != 0 ? one.shares[k] : 0.0F;
    }
    return sum;
  }
  /// The share of one pixel; 0 where it lies too far away.
  float of(std::size_t cell, std::size_t pixel) const {
    const Cell& one = cells_[cell];
    return pixel >= one.begin && pixel - one.begin < one.shares.size()
               ? one.shares[pixel - one.begin]
               : 0.0F;
  }

 private:
  struct Cell {
    std::size_t begin;  ///< first pixel
    std::vector<float> shares;
  };
  std::vector<Cell> cells_;
};

}  // namespace

void DrawnMapOptions::validate() const {
  MapOptions{.cell_mm = cell_mm, .sensor = {.spread_mm = spread_mm, .peak = peak, .prior = prior}}
      .validate();
  if (!(peak > 0.5)) {
    refuse(fmt::format("`peak {}`", peak),
           "must be above 0.5, or a drawing would say nothing of what is occupied");
  }
  if (!(felt_share > 0.0 && felt_share < 1.0)) {
    throw Error(Fault::input, fmt::format("`felt-share {}`: must lie between 0 and 1", felt_share));
  }
  if (!(reach_mm >= 0.0 && reach_mm <= most_length_mm)) {
    refuse(fmt::format("reach = {} mm", reach_mm),
           "give 0 to {:g} mm, the largest distance of an element from the array's centre",
           most_length_mm);
  }
}

OccupancyGrid drawn_map(const std::string& label, const Mask& mask,
                        const DrawnMapOptions& options) {
  options.validate();
  require_sound(label, mask);
  const BoundingBox box = occupied_box(mask);
  if (box.empty()) {
    refuse(fmt::format("mask of '{}'", label),
           "no pixel of {} mm is occupied; mark those of the object, in mm", mask.pixel_mm);
  }
  const double margin_mm = 2.0 * options.reach_mm + margin * options.spread_mm;
  for (const double mm : {box.lower.x, box.lower.y, box.upper.x, box.upper.y}) {
    if (!(std::abs(mm) + margin_mm <= farthest_mm)) {
      refuse(fmt::format("mask of '{}'", label),
             "reaches {} mm from the origin; give an origin nearer to it", mm);
    }
  }
  OccupancyGrid map =
      map_frame({.cell_mm = options.cell_mm,
                 .sensor = {.spread_mm = options.spread_mm, .prior = options.prior}},
                label, cover(box.lower, box.upper, margin_mm, options.cell_mm));
  map.drawn = true;
  const auto nx = static_cast<std::size_t>(map.nx);
  const auto ny = static_cast<std::size_t>(map.ny);
  const double psf_mm = 2.0 * options.spread_mm;
  const Shares along_x(nx, map.origin_mm.x, map.cell_mm, mask.columns, mask.origin_mm.x,
                       mask.pixel_mm, psf_mm);
  const Shares along_y(ny, map.origin_mm.y, map.cell_mm, mask.rows, mask.origin_mm.y, mask.pixel_mm,
                       psf_mm);
  map.log_odds.resize(nx * ny);  // at first the cells' shares
  std::vector<float> row_shares(nx);
  for (std::size_t row = 0; row < mask.rows; ++row) {
    const std::uint8_t* pixels = mask.occupied.data() + row * mask.columns;
    for (std::size_t i = 0; i < nx; ++i) {
      row_shares[i] = along_x.sum(i, pixels);
    }
    for (std::size_t j = 0; j < ny; ++j) {
      const float share = along_y.of(j, row);
      for (std::size_t i = 0; share > 0.0F && i < nx; ++i) {
        map.log_odds[j * nx + i] += share * row_shares[i];
      }
    }
  }
  const double peak = options.peak;
  const double felt_odds = options.felt_share / (1.0 - options.felt_share);
  for (float& cell : map.log_odds) {
    constexpr double most_share = 1.0 - 1e-6;  // what lies beyond `reach` is not known
    const double share = std::min(static_cast<double>(cell), most_share);
    const double odds = std::pow(share / (1.0 - share) / felt_odds, 2.0);
    const double p = (1.0 - peak) + (2.0 * peak - 1.0) * odds / (1.0 + odds);
    cell = static_cast<float>(log_odds_from_probability(p));
  }
  if (std::ranges::none_of(map.log_odds, [](float cell) { return cell > 0.0F; })) {
    refuse(fmt::format("mask of '{}'", label),
           "no cell would be occupied, so small or thin is the object; give a smaller spread, felt "
           "share or cell");
  }
  require_sound_map(map);
  if (const auto measured = measure_symmetry(map)) {
    map.suggested_symmetry = measured->suggested;
  }
  return map;
}

}  // namespace palpate
