#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/particle_filter.hpp"
#include "shaders/interface.h"

namespace palpate {

/// Philox-4x32-10 (Salmon, Moraes, Dror and Shaw 2011): four random words as a function of a
/// counter and a key. The same as in shaders/philox.glsl.
constexpr std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                              std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t x = std::uint64_t{0xD2511F53} * counter[0];
    const std::uint64_t z = std::uint64_t{0xCD9E8D57} * counter[2];
    counter = {
        static_cast<std::uint32_t>(z >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(z),
        static_cast<std::uint32_t>(x >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(x)};
    key[0] += 0x9E3779B9;
    key[1] += 0xBB67AE85;
  }
  return counter;
}

/// A probability in units of 2^-32.
shaders::uint in_words(double probability);

/// The parts of the objects in the initial distribution.
std::vector<shaders::ObjectShare> object_shares(std::span<const Hypothesis> hypotheses,
                                                const ParticleOptions& options);

/// What the blocks' sums say of all particles' weights together. Weights are relative to the
/// largest one, which is 1: however unlikely a touch, they never all vanish.
struct WeightSummary {
  double log_largest = 0.0;  ///< of the weights before that, in nats
  double sum = 0.0;          ///< in [1, n]
  double sum_squares = 0.0;

  /// (sum of weights)^2 / sum of their squares (Kong 1992).
  double effective_sample_size() const { return sum * sum / sum_squares; }
};

WeightSummary summarise(std::span<const shaders::WeightBlock> blocks);

/// Bounds of the blocks for draw_particles, up to the last that weighs anything. Keys are uniform
/// 32-bit words: every draw is independent.
/// @param reuse memory for the result
std::vector<shaders::DrawBlock> multinomial_blocks(std::span<const shaders::WeightBlock> blocks,
                                                   const WeightSummary& summary,
                                                   std::vector<shaders::DrawBlock> reuse = {});
/// Bounds of the blocks for draw_particles where keys are 0, 1, ..., draws - 1: key k draws at the
/// share (k + offset) / draws of the summed weights.
/// @param offset in [0, 1)
std::vector<shaders::DrawBlock> systematic_blocks(std::span<const shaders::WeightBlock> blocks,
                                                  const WeightSummary& summary, std::int64_t draws,
                                                  double offset,
                                                  std::vector<shaders::DrawBlock> reuse = {});

/// Augmented MCL's two running averages of the likelihood (Thrun, Burgard and Fox 2005, Table 8.3).
/// The likelihood of a touch is the product over its known elements, 1e-20 and less, and differs by
/// orders with their number; its geometric mean per element is comparable between touches.
class LikelihoodAverages {
 public:
  LikelihoodAverages(double alpha_slow, double alpha_fast)
      : alpha_slow_(alpha_slow), alpha_fast_(alpha_fast) {}

  /// @param log_mean_weight log of the particles' mean likelihood of the touch
  void add(double log_mean_weight, std::size_t known_elements) {
    const double average = std::exp(log_mean_weight / static_cast<double>(known_elements));
    slow_ = started_ ? slow_ + alpha_slow_ * (average - slow_) : average;
    fast_ = started_ ? fast_ + alpha_fast_ * (average - fast_) : average;
    started_ = true;
  }
  /// The chance that a new particle is a random one.
  double injected() const { return slow_ > 0.0 ? std::max(0.0, 1.0 - fast_ / slow_) : 0.0; }

 private:
  double alpha_slow_;
  double alpha_fast_;
  bool started_ = false;
  double slow_ = 0.0;
  double fast_ = 0.0;
};

}  // namespace palpate
