#include "estimation/particles/particle_draws.hpp"

#include <limits>
#include <utility>

namespace palpate {

namespace {

double log_largest(const shaders::WeightBlock& block) {
  return static_cast<double>(block.max_high) + block.max_low;
}

/// The largest weight of the block in units of the largest of all.
double scale(const shaders::WeightBlock& block, const WeightSummary& summary) {
  return std::exp(log_largest(block) - summary.log_largest);
}

/// The search takes the last block for every key beyond the bounds: it must be one of weight.
void drop_unreached(std::vector<shaders::DrawBlock>& draw) {
  while (draw.size() > 1 && draw[draw.size() - 2].key_end == draw.back().key_end) {
    draw.pop_back();
  }
}

}  // namespace

shaders::uint in_words(double probability) {
  return static_cast<shaders::uint>(
      std::clamp(std::floor(probability * 0x1p32), 0.0, 0x1p32 - 1.0));
}

std::vector<shaders::ObjectShare> object_shares(std::span<const Hypothesis> hypotheses,
                                                const ParticleOptions& options) {
  std::vector<double> weights;
  for (const Hypothesis& hypothesis : hypotheses) {
    weights.push_back(hypothesis.weight);
  }
  // Relative to the largest, for the sum of the weights themselves may be infinite.
  const double largest = *std::max_element(weights.begin(), weights.end());
  double total = 0.0;
  for (double& weight : weights) {
    weight /= largest;
    total += weight;
  }
  std::vector<shaders::ObjectShare> shares;
  double before = 0.0;
  for (const double weight : weights) {
    before += weight;
    shares.push_back({.particle_end = static_cast<shaders::uint>(
                          std::lround(before / total * options.particles)),
                      .chance_end = in_words(before / total)});
  }
  return shares;
}

WeightSummary summarise(std::span<const shaders::WeightBlock> blocks) {
  WeightSummary summary{.log_largest = -std::numeric_limits<double>::infinity()};
  for (const shaders::WeightBlock& block : blocks) {
    summary.log_largest = std::max(summary.log_largest, log_largest(block));
  }
  for (const shaders::WeightBlock& block : blocks) {
    const double unit = scale(block, summary);
    summary.sum += unit * block.sum;
    summary.sum_squares += unit * unit * block.sum_squares;
  }
  return summary;
}

std::vector<shaders::DrawBlock> multinomial_blocks(std::span<const shaders::WeightBlock> blocks,
                                                   const WeightSummary& summary,
                                                   std::vector<shaders::DrawBlock> reuse) {
  constexpr double words = 0x1p32;
  std::vector<shaders::DrawBlock> draw = std::move(reuse);
  draw.clear();
  draw.reserve(blocks.size());
  double before = 0.0;
  for (const shaders::WeightBlock& block : blocks) {
    before += scale(block, summary) * block.sum;
    const double end = std::min(std::floor(before / summary.sum * words), words - 1.0);
    draw.push_back(
        {.key_end = static_cast<shaders::uint>(end), .last = 0.0F, .step = 0.0F, .sum = block.sum});
  }
  drop_unreached(draw);
  return draw;
}

std::vector<shaders::DrawBlock> systematic_blocks(std::span<const shaders::WeightBlock> blocks,
                                                  const WeightSummary& summary, std::int64_t draws,
                                                  double offset,
                                                  std::vector<shaders::DrawBlock> reuse) {
  const auto all = static_cast<double>(draws);
  const double step = summary.sum / all;
  std::vector<shaders::DrawBlock> draw = std::move(reuse);
  draw.clear();
  draw.reserve(blocks.size());
  double before = 0.0;
  for (const shaders::WeightBlock& block : blocks) {
    const double unit = scale(block, summary);
    const double first_key = draw.empty() ? 0.0 : draw.back().key_end;
    // A block of next to no weight takes no key: nothing could be measured in its units.
    const bool counts = unit * block.sum > 1e-9 * step;
    const double end =
        counts ? std::clamp(std::ceil((before + unit * block.sum) / step - offset), first_key, all)
               : first_key;
    draw.push_back(
        {.key_end = static_cast<shaders::uint>(end),
         .last = counts ? static_cast<float>(((end - 1.0 + offset) * step - before) / unit) : 0.0F,
         .step = counts ? static_cast<float>(step / unit) : 0.0F,
         .sum = block.sum});
    before += unit * block.sum;
  }
  drop_unreached(draw);
  // Rounding of the sums may leave the last key beyond all bounds.
  shaders::DrawBlock& last = draw.back();
  last.last += static_cast<float>(draws - last.key_end) * last.step;
  last.key_end = static_cast<shaders::uint>(draws);
  return draw;
}

}  // namespace palpate
