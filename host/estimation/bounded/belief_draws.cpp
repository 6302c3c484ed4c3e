#include "estimation/bounded/belief_draws.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "estimation/pose_draws.hpp"

namespace palpate {

BeliefDraws::BeliefDraws(std::size_t count, std::uint64_t seed, const PoseLattice& lattice,
                         std::span<const double> log_weight, double log_total)
    : lattice_(lattice),
      log_weight_(log_weight),
      log_total_(log_total),
      random_(seed, Stream::belief),
      targets_(one_in_each_part(count, random_)) {
  draws_.reserve(count);
}

void BeliefDraws::add(const BinBox& box, std::span<const double> log_likelihood) {
  const double weight = log_weight_[box.object] - log_total_;
  const std::int64_t bins = box.bins();
  if (log_likelihood.size() == 1) {
    const double p = std::exp(weight + log_likelihood[0]);
    const double after = reached_ + p * static_cast<double>(bins);
    while (is_due(after)) {
      const auto i = static_cast<std::int64_t>((targets_[draws_.size()] - reached_) / p);
      draws_.push_back({box.object, box.bin(std::min(i, bins - 1), lattice_)});
    }
    reached_ = after;
  } else {
    for (std::int64_t i = 0; i < bins; ++i) {
      reached_ += std::exp(weight + log_likelihood[static_cast<std::size_t>(i)]);
      while (is_due(reached_)) {
        draws_.push_back({box.object, box.bin(i, lattice_)});
      }
    }
  }
  last_ = {box.object, box.bin(bins - 1, lattice_)};
}

std::vector<PoseSample> BeliefDraws::take() {
  draws_.resize(targets_.size(), last_);  // rounding may leave the last draw out
  std::sort(draws_.begin(), draws_.end(), [](const Draw& a, const Draw& b) {
    return std::tie(a.object, a.bin) < std::tie(b.object, b.bin);
  });
  std::vector<PoseSample> samples;
  samples.reserve(draws_.size());
  for (const Draw& draw : draws_) {
    samples.push_back({draw.object, draw_within(draw.bin, lattice_, random_)});
  }
  return samples;
}

}  // namespace palpate
