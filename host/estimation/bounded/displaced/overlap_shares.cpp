#include "estimation/bounded/displaced/overlap_shares.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "estimation/bounded/displaced/blurred_plane.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

constexpr double double_unit = 0x1p-53;

/// The largest of the factors of bins [first, end): they fall and then grow along the axis.
double largest_scale(const AxisBlur& axis, int first, int end) {
  const int last = static_cast<int>(axis.scale.size()) - 1;
  const int low = std::clamp(first, 0, last);
  const int high = std::clamp(end - 1, 0, last);
  return std::max(axis.scale[static_cast<std::size_t>(low)],
                  axis.scale[static_cast<std::size_t>(high)]);
}

/// The sum of a Gaussian's weights.
double all_weights(const AxisBlur& axis) {
  double sum = axis.weight.front();
  for (std::size_t k = 1; k < axis.weight.size(); ++k) {
    sum += 2.0 * axis.weight[k];
  }
  return sum;
}

/// The bins [first, end) of an axis that a Gaussian reaches from others, as far as there are any.
std::pair<int, int> reached(const Axis& axis, const AxisBlur& blur, int first, int end) {
  return {std::max(0, first - blur.steps), std::min(axis.count, end + blur.steps)};
}

/// What taps carry to the bins about a box: changes along each row at first, then their sums.
class CarriedWeights {
 public:
  CarriedWeights(int x_first, int x_end, int y_first, int y_end)
      : x_first_(x_first),
        y_first_(y_first),
        width_(static_cast<std::size_t>(x_end - x_first)),
        height_(y_end - y_first),
        sums_(width_ * static_cast<std::size_t>(height_)),
        added_(static_cast<std::size_t>(height_)),
        steps_(static_cast<std::size_t>(height_)) {}

  bool holds_row(int y) const { return y >= y_first_ && y < y_first_ + height_; }

  void add(int y, std::span<const OverlapShares::Step> row, int moved, double fraction,
           double weight) {
    if (!holds_row(y) || weight == 0.0) {
      return;
    }
    const auto at = static_cast<std::size_t>(y - y_first_);
    double* const sums = sums_.data() + at * width_;
    const auto change = [&](int x, double more) {
      const int place = std::max(x - x_first_, 0);
      if (place < static_cast<int>(width_)) {
        sums[place] += more;
      }
    };
    for (const OverlapShares::Step& step : row) {
      change(step.x + moved, step.more * weight * (1.0 - fraction));
      change(step.x + moved + 1, step.more * weight * fraction);
      added_[at] += std::abs(step.more) * weight;
    }
    steps_[at] += 2 * row.size();
  }

  /// The sums of a row's changes, [x]. To be asked for once.
  double* summed(int y) {
    double* const sums = sums_.data() + static_cast<std::size_t>(y - y_first_) * width_;
    double sum = 0.0;
    for (std::size_t x = 0; x < width_; ++x) {
      sum += sums[x];
      sums[x] = std::max(sum, 0.0);
    }
    return sums;
  }
  /// Bound of the rounding of all sums.
  double rounding() const {
    double most = 0.0;
    for (std::size_t y = 0; y < added_.size(); ++y) {
      most = std::max(most, static_cast<double>(steps_[y] + width_) * added_[y]);
    }
    return 2.0 * double_unit * most;
  }

 private:
  int x_first_;
  int y_first_;
  std::size_t width_;
  int height_;
  std::vector<double> sums_;        ///< [y, x]
  std::vector<double> added_;       ///< [y] magnitudes of all changes
  std::vector<std::size_t> steps_;  ///< [y]
};

}  // namespace

OverlapShares::OverlapShares(const DisplacementWeights& weights, const ArrayRectangle& array,
                             const glm::dvec2& sensor_from_pivot_mm,
                             std::span<const BoundingBox> objects, bool everywhere)
    : weights_(weights),
      array_(array),
      objects_(objects),
      everywhere_(everywhere),
      fraction_error_(weights.fraction_error(sensor_from_pivot_mm)),
      x_(weights.lattice().x_mm, weights.sd().mm, 1),
      y_(weights.lattice().y_mm, weights.sd().mm, 1),
      taken_(static_cast<std::size_t>(weights.lattice().theta_rad.count)) {
  for (int theta = 0; theta < weights.lattice().theta_rad.count; ++theta) {
    taps_.push_back(weights.taps(theta, sensor_from_pivot_mm));
    for (std::size_t i = 0; i < taps_.back().size(); ++i) {
      taken_[static_cast<std::size_t>(taps_.back()[i].theta)].push_back({theta, i});
    }
  }
  extents_.resize(objects.size() * taps_.size());
  parallel_for(extents_.size(), [&](std::size_t i) {
    extents_[i] = extent(i / taps_.size(), static_cast<int>(i % taps_.size()));
  });
}

std::vector<OverlapPlane::Bins> OverlapShares::rows(std::size_t object, int theta) const {
  const PoseLattice& lattice = weights_.lattice();
  std::vector<OverlapPlane::Bins> rows(static_cast<std::size_t>(lattice.y_mm.count),
                                       {0, lattice.x_mm.count});
  if (!everywhere_) {
    OverlapPlane(array_, objects_[object], lattice, theta).find_rows(rows);
  }
  return rows;
}

OverlapShares::Extent OverlapShares::extent(std::size_t object, int theta) const {
  const PoseLattice& lattice = weights_.lattice();
  Extent found{.box = {.object = static_cast<std::int32_t>(object), .theta = theta}};
  const BinBox& box = found.box;
  found.bins = count_bins(rows(object, theta), found.box);
  if (found.bins == 0) {
    return found;
  }
  double least = 0.0;
  for (const Tap& tap : taps_[static_cast<std::size_t>(theta)]) {
    // The part inside grows and then falls along an axis: least is that of the first or last bin.
    const auto least_inside = [](const Axis& axis, int first, int count, int moved,
                                 double fraction) {
      return std::min(part_inside(axis, first + moved, fraction),
                      part_inside(axis, first + count - 1 + moved, fraction));
    };
    const double part =
        least_inside(lattice.x_mm, box.x_first, box.x_count, tap.bins.x, tap.fraction.x) *
        least_inside(lattice.y_mm, box.y_first, box.y_count, tap.bins.y, tap.fraction.y);
    found.inside = found.inside && part == 1.0;
    least += tap.weight * part;
  }
  found.most_weight = 1.0 / least;  // the bin itself lies inside
  return found;
}

BinBox OverlapShares::reach(std::size_t object, int theta) const {
  const PoseLattice& lattice = weights_.lattice();
  BinBox all{.object = static_cast<std::int32_t>(object), .theta = theta};
  for (const auto& [from, index] : taken_[static_cast<std::size_t>(theta)]) {
    const Tap& tap = taps_[static_cast<std::size_t>(from)][index];
    const BinBox& box = extent_of(object, from).box;
    if (box.bins() == 0) {
      continue;
    }
    // A bin more, which a tap that lies between bins takes, too; and one before, which a tap takes
    // that lies at a bin but for rounding.
    const int before = fraction_error_ > 0.0 ? 1 : 0;
    const auto [x, x_end] = reached(lattice.x_mm, x_, box.x_first + tap.bins.x - before,
                                    box.x_first + box.x_count + tap.bins.x + 1);
    const auto [y, y_end] = reached(lattice.y_mm, y_, box.y_first + tap.bins.y - before,
                                    box.y_first + box.y_count + tap.bins.y + 1);
    if (x < x_end && y < y_end) {
      all = smallest_around(all, {all.object, theta, y, y_end - y, x, x_end - x});
    }
  }
  return all;
}

double OverlapShares::most(std::size_t object, int theta) const {
  double sum = 0.0;
  for (const auto& [from, index] : taken_[static_cast<std::size_t>(theta)]) {
    const Tap& tap = taps_[static_cast<std::size_t>(from)][index];
    const Extent& extent = extent_of(object, from);
    if (extent.box.bins() > 0) {
      const int x = extent.box.x_first + tap.bins.x;
      const int y = extent.box.y_first + tap.bins.y;
      sum += tap.weight * extent.most_weight * largest_scale(x_, x, x + extent.box.x_count + 1) *
             largest_scale(y_, y, y + extent.box.y_count + 1);
    }
  }
  return sum * all_weights(x_) * all_weights(y_) * std::exp(relative_error()) *
         (1.0 + 32.0 * fraction_error_);
}

OverlapShares::Plane OverlapShares::plane(const Extent& extent) const {
  const PoseLattice& lattice = weights_.lattice();
  const BinBox& box = extent.box;
  const std::vector<OverlapPlane::Bins> of_row =
      rows(static_cast<std::size_t>(box.object), box.theta);
  const std::vector<Tap>& taps = taps_[static_cast<std::size_t>(box.theta)];
  Plane plane{.y_first = box.y_first, .rows = {}};
  std::vector<double> weights(static_cast<std::size_t>(box.x_count));  // inside, of a row's bins
  bool of_inner_row = false;  // so far inside that all such rows have the same
  for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
    std::vector<Step>& steps = plane.rows.emplace_back();
    const OverlapPlane::Bins& bins = of_row[static_cast<std::size_t>(y)];
    if (bins.count == 0) {
      continue;
    }
    if (extent.inside) {
      steps = {{bins.first, extent.most_weight}, {bins.first + bins.count, -extent.most_weight}};
      continue;
    }
    const bool inner = std::ranges::all_of(taps, [&](const Tap& tap) {
      return part_inside(lattice.y_mm, y + tap.bins.y, tap.fraction.y) == 1.0;
    });
    if (!inner || !of_inner_row) {
      std::ranges::fill(weights, 0.0);
      for (const Tap& tap : taps) {
        const double of_tap =
            tap.weight * part_inside(lattice.y_mm, y + tap.bins.y, tap.fraction.y);
        for (int i = 0; i < box.x_count; ++i) {
          weights[static_cast<std::size_t>(i)] +=
              of_tap * part_inside(lattice.x_mm, box.x_first + i + tap.bins.x, tap.fraction.x);
        }
      }
      of_inner_row = inner;
    }
    double before = 0.0;
    for (int x = bins.first; x < bins.first + bins.count; ++x) {
      const double counts = 1.0 / weights[static_cast<std::size_t>(x - box.x_first)];
      if (counts != before) {
        steps.push_back({x, counts - before});
        before = counts;
      }
    }
    steps.push_back({bins.first + bins.count, -before});
  }
  return plane;
}

OverlapShares::Shares OverlapShares::at(const BinBox& box, Planes& of_object) const {
  const PoseLattice& lattice = weights_.lattice();
  const auto object = static_cast<std::size_t>(box.object);
  const int x_end = box.x_first + box.x_count;
  const int y_end = box.y_first + box.y_count;
  // As wide as the Gaussians are, also where that lies outside the region and nothing is carried.
  const int x = box.x_first - x_.steps;
  const int y = box.y_first - y_.steps;
  const int width = x_end + x_.steps - x;
  CarriedWeights carried(x, x + width, y, y_end + y_.steps);
  for (const auto& [from, index] : taken_[static_cast<std::size_t>(box.theta)]) {
    const Tap& tap = taps_[static_cast<std::size_t>(from)][index];
    const Extent& extent = extent_of(object, from);
    if (extent.box.bins() == 0) {
      continue;
    }
    auto found = of_object.find(from);
    if (found == of_object.end()) {
      found = of_object.emplace(from, plane(extent)).first;
    }
    int row = found->second.y_first + tap.bins.y;
    for (const std::vector<Step>& steps : found->second.rows) {
      carried.add(row, steps, tap.bins.x, tap.fraction.x, tap.weight * (1.0 - tap.fraction.y));
      carried.add(row + 1, steps, tap.bins.x, tap.fraction.x, tap.weight * tap.fraction.y);
      ++row;
    }
  }
  // Each bin's factor, nothing outside the region.
  std::vector<double> scale(static_cast<std::size_t>(width));
  std::copy(x_.scale.begin() + std::max(x, 0),
            x_.scale.begin() + std::min(x + width, lattice.x_mm.count),
            scale.begin() + std::max(-x, 0));
  const auto height =
      static_cast<std::size_t>(box.y_count) + 2 * static_cast<std::size_t>(y_.steps);
  std::vector<double> along_x(height * static_cast<std::size_t>(box.x_count));
  for (int j = std::max(0, y); j < std::min(lattice.y_mm.count, y_end + y_.steps); ++j) {
    double* const sums = carried.summed(j);
    for (int i = 0; i < width; ++i) {
      sums[i] *= scale[static_cast<std::size_t>(i)] * y_.scale[static_cast<std::size_t>(j)];
    }
    blur<BinLikelihoods>(sums + x_.steps, along_x.data() + std::ptrdiff_t{j - y} * box.x_count,
                         box.x_count, 1, x_.weight);
  }
  Shares shares{.of_bins = std::vector<double>(static_cast<std::size_t>(box.bins()))};
  for (int j = 0; j < box.y_count; ++j) {
    blur<BinLikelihoods>(along_x.data() + std::ptrdiff_t{j + y_.steps} * box.x_count,
                         shares.of_bins.data() + std::ptrdiff_t{j} * box.x_count, box.x_count,
                         box.x_count, y_.weight);
  }
  // Fractions change by their error what a tap carries to a bin, from each of four, and what lies
  // inside the region.
  const double of_all = all_weights(x_) * all_weights(y_) * largest_scale(x_, x, x + width) *
                        largest_scale(y_, y, y_end + y_.steps);
  shares.error = carried.rounding() * of_all + 32.0 * fraction_error_ * most(object, box.theta);
  return shares;
}

double OverlapShares::relative_error() const {
  // As DisplacementMean::mean_error(): weights, and a unit for each term of the sums, here twice.
  constexpr double of_weights = 256.0;
  const double terms = 2.0 * (x_.steps + y_.steps) + 4.0 * (2.0 * weights_.theta_steps() + 1.0);
  return (of_weights + 4.0 * terms) * double_unit;
}

}  // namespace palpate
