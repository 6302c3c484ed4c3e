#include <algorithm>
#include <span>

#include "cases.hpp"
#include "letters.hpp"
#include "measurement.hpp"

namespace palpate::bench {

namespace {

constexpr double goal_ms = 80.0;
constexpr double goal_with_marginals_ms = 160.0;

struct Answers {
  Estimate estimate;
  std::vector<Marginals> marginals;
};

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(std::as_bytes(std::span(a)), std::as_bytes(std::span(b)));
}

bool same_bits(const Answers& a, const Answers& b) {
  return same_bits(a.estimate.identity, b.estimate.identity) &&
         a.estimate.mode.object == b.estimate.mode.object &&
         a.estimate.mode.bin == b.estimate.mode.bin &&
         same_bits({a.estimate.mode.log_likelihood}, {b.estimate.mode.log_likelihood}) &&
         std::ranges::equal(a.marginals, b.marginals, [](const Marginals& m, const Marginals& n) {
           return same_bits(m.xy, n.xy) && same_bits(m.theta, n.theta);
         });
}

}  // namespace

Case reduction_case(const Inputs& inputs, PoseHistogram& histogram) {
  const int objects = static_cast<int>(inputs.letters.size());
  const auto ask = [&](bool marginals) {
    histogram.update(std::span<const Touch>());  // forgets the sums that it has
    Answers answers{.estimate = histogram.estimate(), .marginals = {}};
    for (int object = 0; marginals && object < objects; ++object) {
      answers.marginals.push_back(histogram.marginals(object));
    }
    return answers;
  };
  const bool repeatable = same_bits(ask(true), ask(true));
  const int repeats = inputs.quick ? 3 : 15;
  const PoseLattice& lattice = histogram.lattice();
  const bool large = objects * lattice.bins() > 10'000'000;
  const auto goal = [&](double ms) { return large ? std::optional(at_most(ms)) : std::nullopt; };
  return {
      .name = "reductions " + size_of(lattice),
      .facts = {{"objects", objects}, {"repeats", repeats}},
      .measurements = {
          {"identity and mode", 1e3 * median_seconds([&] { ask(false); }, repeats), "ms",
           goal(goal_ms)},
          {"identity, mode and all marginals", 1e3 * median_seconds([&] { ask(true); }, repeats),
           "ms", goal(goal_with_marginals_ms)},
          {"two runs of equal bits", repeatable ? 1.0 : 0.0, "(1 is yes)", at_least(1)}}};
}

}  // namespace palpate::bench
