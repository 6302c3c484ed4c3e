#include "sampled_touch_mean.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "random.hpp"

namespace palpate {

namespace {

/// Mixes all bits (the finaliser of SplitMix64; Steele, Lea and Flood 2014).
std::uint64_t mixed(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return z ^ (z >> 31);
}

std::uint64_t fingerprint_of(const KnownElements& elements) {
  std::uint64_t print = 0;
  for (const ReadingRun& run : elements.runs) {
    print = mixed(print ^ static_cast<std::uint64_t>(run.reading));
    for (std::size_t e = run.begin; e < run.end; ++e) {
      print = mixed(print ^ std::bit_cast<std::uint64_t>(elements.from_pivot_mm[e].x));
      print = mixed(print ^ std::bit_cast<std::uint64_t>(elements.from_pivot_mm[e].y));
    }
  }
  return print;
}

/// The bins of a plane over which a touch's mean is.
class Plane {
 public:
  Plane(const ArrayRectangle& array, const BoundingBox& object, const PoseLattice& lattice,
        int theta, bool everywhere)
      : overlap_(array, object, lattice, theta), lattice_(lattice), everywhere_(everywhere) {}

  OverlapPlane::Bins rows() const {
    return everywhere_ ? OverlapPlane::Bins{0, lattice_.y_mm.count} : overlap_.rows();
  }
  OverlapPlane::Bins row(int y) const {
    return everywhere_ ? OverlapPlane::Bins{0, lattice_.x_mm.count} : overlap_.row(y);
  }
  std::int64_t bins() const { return everywhere_ ? lattice_.plane() : overlap_.bins(); }

 private:
  OverlapPlane overlap_;
  const PoseLattice& lattice_;
  bool everywhere_;
};

/// An object's likelihood summed over its bins, by a sample.
struct ObjectSum {
  double log_scale = -std::numeric_limits<double>::infinity();  ///< of the largest likelihood drawn
  double sum = 0.0;                                             ///< over exp(log_scale)
  double variance = 0.0;                                        ///< of `sum`
};

}  // namespace

std::int64_t SampledTouchMeans::Strata::begin(std::int64_t stratum) const {
  // In parts: bins * stratum may exceed 64 bits.
  return bins / count * stratum + bins % count * stratum / count;
}

SampledTouchMeans::SampledTouchMeans(std::span<const Hypothesis> hypotheses,
                                     const ContactModel& contact, const PoseLattice& lattice,
                                     std::span<const double> log_weight,
                                     const BinLikelihood& likelihood)
    : contact_(contact),
      lattice_(lattice),
      log_weight_(log_weight.begin(), log_weight.end()),
      likelihood_(likelihood) {
  for (const Hypothesis& hypothesis : hypotheses) {
    boxes_.push_back(occupied_box(hypothesis.map));
  }
}

void SampledTouchMeans::reset() { means_.clear(); }

void SampledTouchMeans::move_pivot(const glm::dvec2& pivot_mm) { lattice_.pivot_mm = pivot_mm; }

std::vector<TouchMean> SampledTouchMeans::evaluate(
    std::span<const Touch> touches, const std::function<void(std::size_t)>& progress) const {
  std::vector<TouchMean> means;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const KnownElements elements = gather_elements(touches[i], contact_, lattice_.pivot_mm);
    // A touch without a known element says nothing, not even where the array was.
    if (!elements.empty()) {
      const std::uint64_t fingerprint = fingerprint_of(elements);
      const auto same = [&](const TouchMean& mean) { return mean.fingerprint == fingerprint; };
      const auto times_before =
          std::ranges::count_if(means_, same) + std::ranges::count_if(means, same);
      means.push_back(
          mean_of(touches[i], elements, fingerprint, static_cast<std::uint64_t>(times_before)));
    }
    if (progress) {
      progress(i + 1);
    }
  }
  return means;
}

void SampledTouchMeans::add(std::span<const TouchMean> means) {
  means_.insert(means_.end(), means.begin(), means.end());
}

double SampledTouchMeans::log_evidence() const {
  if (means_.empty()) {
    return 0.0;
  }
  // In an order of their own, so that the order of touches shows in no bit.
  std::vector<double> logs;
  for (const TouchMean& mean : means_) {
    logs.push_back(mean.log_mean);
  }
  std::sort(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double log_mean : logs) {
    sum += log_mean;
  }
  return means_.front().log_share + sum;
}

double SampledTouchMeans::standard_error() const {
  std::vector<double> squares;
  for (const TouchMean& mean : means_) {
    squares.push_back(mean.squared_error);
  }
  std::sort(squares.begin(), squares.end());
  double sum = 0.0;
  for (const double square : squares) {
    sum += square;
  }
  return std::sqrt(sum);
}

TouchMean SampledTouchMeans::mean_of(const Touch& touch, const KnownElements& elements,
                                     std::uint64_t fingerprint, std::uint64_t times_before) const {
  const ArrayRectangle array = array_rectangle(touch, lattice_.pivot_mm);
  const Overlap overlap = overlap_of(array);
  const std::vector<Strata> strata = strata_of(overlap);

  Random random(mixed(fingerprint + times_before), Stream::touch_means);
  const auto below = [&](std::int64_t bound) {
    return std::min(static_cast<std::int64_t>(random.uniform() * static_cast<double>(bound)),
                    bound - 1);
  };
  std::vector<std::int64_t> ordinals;
  std::int64_t object_begin = 0;
  for (const Strata& object : strata) {
    for (std::int64_t i = 0; object.count == 0 && i < object.bins; ++i) {
      ordinals.push_back(object_begin + i);
    }
    for (std::int64_t h = 0; h < object.count; ++h) {
      const std::int64_t begin = object.begin(h);
      const std::int64_t bins = object.begin(h + 1) - begin;
      const std::int64_t one = below(bins);
      const std::int64_t draw = below(bins - 1);
      const std::int64_t other = draw + (draw >= one ? 1 : 0);
      ordinals.push_back(object_begin + begin + std::min(one, other));
      ordinals.push_back(object_begin + begin + std::max(one, other));
    }
    object_begin += object.bins;
  }
  const std::vector<double> logs = evaluated(places_of(ordinals, overlap, array), elements);

  std::vector<ObjectSum> sums(strata.size());
  double log_scale = -std::numeric_limits<double>::infinity();
  const double* log = logs.data();
  for (std::size_t object = 0; object < strata.size(); ++object) {
    const Strata& of = strata[object];
    if (of.bins == 0) {
      continue;
    }
    ObjectSum& sum = sums[object];
    sum.log_scale = *std::max_element(log, log + of.draws());
    for (std::int64_t i = 0; of.count == 0 && i < of.bins; ++i) {
      sum.sum += std::exp(*log++ - sum.log_scale);
    }
    for (std::int64_t h = 0; h < of.count; ++h) {
      const auto bins = static_cast<double>(of.begin(h + 1) - of.begin(h));
      const double one = std::exp(*log++ - sum.log_scale);
      const double other = std::exp(*log++ - sum.log_scale);
      sum.sum += bins * (one + other) / 2.0;
      // N^2 (1 - n / N) s^2 / n for n = 2 draws of N bins, with s^2 = (one - other)^2 / 2.
      sum.variance += bins * (bins - 2.0) * (one - other) * (one - other) / 4.0;
    }
    log_scale = std::max(log_scale, log_weight_[object] + sum.log_scale);
  }
  double total = 0.0;
  double variance = 0.0;
  for (std::size_t object = 0; object < sums.size(); ++object) {
    const double scale = std::exp(log_weight_[object] + sums[object].log_scale - log_scale);
    total += scale * sums[object].sum;
    variance += scale * scale * sums[object].variance;
  }
  return {.log_mean = log_scale + std::log(total) - std::log(overlap.weighted_bins),
          .squared_error = variance / (total * total),
          .log_share = std::log(overlap.weighted_bins / static_cast<double>(lattice_.bins())),
          .fingerprint = fingerprint};
}

SampledTouchMeans::Overlap SampledTouchMeans::overlap_of(const ArrayRectangle& array) const {
  const auto thetas = static_cast<std::size_t>(lattice_.theta_rad.count);
  Overlap overlap;
  const auto count = [&] {
    overlap.plane_end.assign(boxes_.size() * thetas, 0);
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, overlap.plane_end.size(), 8), [&](const auto& range) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            overlap.plane_end[i] = Plane(array, boxes_[i / thetas], lattice_,
                                         static_cast<int>(i % thetas), overlap.everywhere)
                                       .bins();
          }
        });
    overlap.bins.assign(boxes_.size(), 0);
    overlap.weighted_bins = 0.0;
    std::int64_t end = 0;
    for (std::size_t i = 0; i < overlap.plane_end.size(); ++i) {
      overlap.bins[i / thetas] += overlap.plane_end[i];
      overlap.plane_end[i] = end += overlap.plane_end[i];
    }
    for (std::size_t object = 0; object < boxes_.size(); ++object) {
      overlap.weighted_bins +=
          std::exp(log_weight_[object]) * static_cast<double>(overlap.bins[object]);
    }
  };
  count();
  if (overlap.weighted_bins == 0.0) {
    // No pose of the region brings the array to an object: all poses are alike.
    overlap.everywhere = true;
    count();
  }
  return overlap;
}

std::vector<SampledTouchMeans::Strata> SampledTouchMeans::strata_of(const Overlap& overlap) const {
  std::vector<Strata> strata;
  std::int64_t bins = 0;
  for (const std::int64_t n : overlap.bins) {
    strata.push_back({.bins = n});
    bins += n;
  }
  if (bins <= bins_per_touch_mean) {
    return strata;
  }
  // Half of the draws by prior weight and bins; half in equal parts, because an unlikely object may
  // be the one that explains the touch. Objects that have fewer bins than draws leave theirs to the
  // others.
  std::vector<double> draws(strata.size(), std::numeric_limits<double>::infinity());
  const auto whole = [&](std::size_t object) {
    return static_cast<double>(strata[object].bins) <= std::max(2.0, draws[object]);
  };
  for (bool settled = false; !settled;) {
    double left = static_cast<double>(bins_per_touch_mean);
    double weight = 0.0;
    std::size_t others = 0;
    for (std::size_t object = 0; object < strata.size(); ++object) {
      const auto n = static_cast<double>(strata[object].bins);
      if (std::isfinite(draws[object]) && whole(object)) {
        left -= n;
      } else {
        weight += std::exp(log_weight_[object]) * n;
        ++others;
      }
    }
    settled = true;
    for (std::size_t object = 0; object < strata.size(); ++object) {
      const auto n = static_cast<double>(strata[object].bins);
      if (std::isfinite(draws[object]) && whole(object)) {
        continue;
      }
      const double by_weight = weight > 0.0 ? std::exp(log_weight_[object]) * n / weight : 0.0;
      draws[object] = left * (by_weight + 1.0 / static_cast<double>(others)) / 2.0;
      settled = settled && !whole(object);
    }
  }
  for (std::size_t object = 0; object < strata.size(); ++object) {
    if (!whole(object)) {
      strata[object].count =
          std::max(std::int64_t{1}, static_cast<std::int64_t>(draws[object] / 2));
    }
  }
  return strata;
}

std::vector<SampledTouchMeans::PlaceOfBin> SampledTouchMeans::places_of(
    std::span<const std::int64_t> ordinals, const Overlap& overlap,
    const ArrayRectangle& array) const {
  std::vector<PlaceOfBin> places(ordinals.size());
  const int thetas = lattice_.theta_rad.count;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, overlap.plane_end.size(), 8), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          std::int64_t row_begin = i == 0 ? 0 : overlap.plane_end[i - 1];
          auto at = std::lower_bound(ordinals.begin(), ordinals.end(), row_begin);
          if (at == ordinals.end() || *at >= overlap.plane_end[i]) {
            continue;
          }
          const auto object = static_cast<std::int32_t>(i / static_cast<std::size_t>(thetas));
          const auto theta = static_cast<std::int32_t>(i % static_cast<std::size_t>(thetas));
          const Plane plane(array, boxes_[static_cast<std::size_t>(object)], lattice_, theta,
                            overlap.everywhere);
          for (int y = plane.rows().first; at != ordinals.end() && *at < overlap.plane_end[i];
               ++y) {
            const OverlapPlane::Bins row = plane.row(y);
            for (; at != ordinals.end() && *at < row_begin + row.count; ++at) {
              places[static_cast<std::size_t>(at - ordinals.begin())] = {
                  object, theta, y, row.first + static_cast<std::int32_t>(*at - row_begin)};
            }
            row_begin += row.count;
          }
        }
      });
  return places;
}

std::vector<double> SampledTouchMeans::evaluated(std::span<const PlaceOfBin> places,
                                                 const KnownElements& elements) const {
  std::vector<double> logs(places.size());
  constexpr std::size_t at_once = 512;
  tbb::parallel_for(std::size_t{0}, (places.size() + at_once - 1) / at_once, [&](std::size_t part) {
    const std::size_t first = part * at_once;
    const std::size_t count = std::min(at_once, places.size() - first);
    std::vector<BinBox> boxes;
    boxes.reserve(count);
    for (const PlaceOfBin& at : places.subspan(first, count)) {
      if (!boxes.empty() && boxes.back().object == at.object && boxes.back().theta == at.theta &&
          boxes.back().y_first == at.y && boxes.back().x_first + boxes.back().x_count == at.x) {
        ++boxes.back().x_count;
      } else {
        boxes.push_back({at.object, at.theta, at.y, 1, at.x, 1});
      }
    }
    likelihood_.evaluate(boxes, elements, std::span(logs).subspan(first, count));
  });
  return logs;
}

}  // namespace palpate
