#include "estimation/bounded/belief_draws.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace palpate {

BeliefDraws::BeliefDraws(std::size_t count, std::uint64_t seed, const PoseLattice& lattice,
                         std::span<const double> log_weight, double log_total)
    : lattice_(lattice),
      log_weight_(log_weight),
      log_total_(log_total),
      random_(seed, Stream::belief) {
  targets_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    targets_.push_back((static_cast<double>(i) + random_.uniform()) / static_cast<double>(count));
  }
  draws_.reserve(count);
}

BeliefDraws::Draw BeliefDraws::draw_of(const BinBox& box, std::int64_t i) const {
  const std::int64_t row =
      std::int64_t{box.theta} * lattice_.y_mm.count + box.y_first + i / box.x_count;
  return {box.object, row * lattice_.x_mm.count + box.x_first + i % box.x_count};
}

void BeliefDraws::add(const BinBox& box, std::span<const double> log_likelihood) {
  const double weight = log_weight_[box.object] - log_total_;
  const std::int64_t bins = box.bins();
  if (log_likelihood.size() == 1) {
    const double p = std::exp(weight + log_likelihood[0]);
    const double after = reached_ + p * static_cast<double>(bins);
    while (is_due(after)) {
      const auto i = static_cast<std::int64_t>((targets_[draws_.size()] - reached_) / p);
      draws_.push_back(draw_of(box, std::min(i, bins - 1)));
    }
    reached_ = after;
  } else {
    for (std::int64_t i = 0; i < bins; ++i) {
      reached_ += std::exp(weight + log_likelihood[static_cast<std::size_t>(i)]);
      while (is_due(reached_)) {
        draws_.push_back(draw_of(box, i));
      }
    }
  }
  last_ = draw_of(box, bins - 1);
}

std::vector<PoseSample> BeliefDraws::take() {
  draws_.resize(targets_.size(), last_);  // rounding may leave the last draw out
  std::sort(draws_.begin(), draws_.end(), [](const Draw& a, const Draw& b) {
    return std::tie(a.object, a.bin) < std::tie(b.object, b.bin);
  });
  std::vector<PoseSample> samples;
  samples.reserve(draws_.size());
  const auto within = [&](const Axis& axis, std::int64_t bin) {
    return axis.centre(static_cast<int>(bin)) + random_.uniform(-0.5, 0.5) * axis.step();
  };
  for (const Draw& draw : draws_) {
    const double x = within(lattice_.x_mm, draw.bin % lattice_.x_mm.count);
    const double y = within(lattice_.y_mm, draw.bin % lattice_.plane() / lattice_.x_mm.count);
    const double theta = within(lattice_.theta_rad, draw.bin / lattice_.plane());
    samples.push_back({draw.object, lattice_.T_object_robot(x, y, theta)});
  }
  return samples;
}

}  // namespace palpate
