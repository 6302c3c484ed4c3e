#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shaders/interface.h"

namespace palpate {

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

}  // namespace palpate
