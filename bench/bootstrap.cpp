#include "bootstrap.hpp"

#include <vector>

#include "model/random.hpp"

namespace palpate::bench {

namespace {

constexpr int samples = 2'000;
constexpr std::uint64_t seed = 20'260'101;

double sum_of(std::span<const double> values, std::span<const std::size_t> trials) {
  double sum = 0.0;
  for (const std::size_t trial : trials) {
    sum += values[trial];
  }
  return sum;
}

}  // namespace

Interval bootstrap_interval(std::size_t trials, const Statistic& statistic) {
  Random random(seed, Stream::touch_order);
  std::vector<std::size_t> drawn(trials);
  std::vector<double> values;
  for (int sample = 0; sample < samples; ++sample) {
    for (std::size_t& trial : drawn) {
      trial = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(trials)));
    }
    values.push_back(statistic(drawn));
  }
  return {quantile(values, 0.025), quantile(values, 0.975)};
}

Interval bootstrap_mean_interval(std::span<const double> values) {
  return bootstrap_interval(values.size(), [&](std::span<const std::size_t> trials) {
    return sum_of(values, trials) / static_cast<double>(trials.size());
  });
}

Interval bootstrap_ratio_interval(std::span<const double> numerators,
                                  std::span<const double> denominators) {
  return bootstrap_interval(numerators.size(), [&](std::span<const std::size_t> trials) {
    return sum_of(numerators, trials) / sum_of(denominators, trials);
  });
}

}  // namespace palpate::bench
