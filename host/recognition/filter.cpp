#include "recognition/filter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "model/random.hpp"

namespace palpate {

namespace {

/// What all filters have under the same names.
template <typename Own>
class FilterOf : public Filter {
 public:
  explicit FilterOf(Own own) : own_(std::move(own)) {}

  void reset() override { own_.reset(); }
  void move_pivot(const glm::dvec2& pivot_mm) override { own_.move_pivot(pivot_mm); }
  void update(std::span<const TouchEvidence> touches,
              const std::function<void(double)>& progress) override {
    own_.update(touches, progress);
  }
  Estimate estimate(std::optional<double> /*tolerance*/) const override { return own_.estimate(); }

 protected:
  Own own_;
};

/// What filters with bins have besides.
template <typename Own>
class FilterInBins : public FilterOf<Own> {
 public:
  using FilterOf<Own>::FilterOf;

  std::optional<RefinedPose> refine(const Mode& mode) const override {
    return this->own_.refine(mode);
  }
  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed) const override {
    return this->own_.sample(count, seed);
  }
  std::vector<std::vector<BinShare>> likely_bins(std::span<const int> objects, double least_share,
                                                 PoseLattice& /*lattice*/) const override {
    return this->own_.likely_bins(objects, least_share);
  }
  std::optional<double> entropy() const override { return this->own_.entropy(); }
  std::vector<TouchGain> expected_gain(std::span<const Pose> T_robot_sensor,
                                       std::span<const glm::dvec2> elements_mm,
                                       const PlanOptions& plan) const override {
    return this->own_.expected_gain(T_robot_sensor, elements_mm, plan);
  }
};

class HistogramFilter final : public FilterInBins<PoseHistogram> {
 public:
  using FilterInBins::FilterInBins;

  Marginals marginals(int object, const PoseLattice& /*lattice*/) const override {
    return own_.marginals(object);
  }
  std::vector<std::string> words() const override {
    return {fmt::format("histogram in {}", fmt::join(own_.paths(), "; "))};
  }
  std::uint64_t device_bytes() const override { return own_.device_bytes(); }
  const PoseHistogram* histogram() const override { return &own_; }
};

class BoundedFilter final : public FilterInBins<BoundedPosterior> {
 public:
  BoundedFilter(std::span<const Hypothesis> hypotheses, const BoundedOptions& options)
      : FilterInBins(BoundedPosterior(hypotheses, options)),
        goal_(fmt::format("tolerance {:g}", options.tolerance) +
              (options.budget_s ? fmt::format(", budget {:g} ms", 1e3 * *options.budget_s) : "")) {}

  Estimate estimate(std::optional<double> tolerance) const override {
    return own_.estimate(tolerance);
  }
  Marginals marginals(int object, const PoseLattice& lattice) const override {
    return own_.marginals(object, marginal_grid(lattice));
  }
  std::optional<EvaluatedBelief> evaluated_bins() const override { return own_.evaluated_bins(); }
  std::vector<std::string> words() const override {
    return {fmt::format("bounded, {}; {:.1f} MiB of the host's memory", own_.path(),
                        static_cast<double>(own_.host_bytes()) / (1 << 20)),
            goal_};
  }
  std::uint64_t host_bytes() const override { return own_.host_bytes(); }

 private:
  std::string goal_;
};

// Steps of the grid on which the paper looks for the particles' mode (Eq. 12).
constexpr double parzen_step_mm = 0.5;
constexpr double parzen_step_rad = 0.04 * std::numbers::pi;

class Particles final : public FilterOf<ParticleFilter> {
 public:
  Particles(Device& device, std::span<const Hypothesis> hypotheses, const ParticleOptions& options)
      : FilterOf(ParticleFilter(device, hypotheses, options)),
        words_(fmt::format(
            "{} particles, {} resampling{}, seed {}", options.particles,
            options.resampling == Resampling::multinomial ? "multinomial" : "systematic",
            options.augmented ? ", random particles added" : "", options.seed)) {}

  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed) const override {
    const std::vector<ParticleFilter::Particle> particles = own_.particles();
    double all = 0.0;
    for (const ParticleFilter::Particle& particle : particles) {
      all += particle.weight;
    }
    Random random(seed, Stream::belief);
    std::vector<PoseSample> samples;
    auto particle = particles.begin();
    double reached = particle->weight;
    for (const double part : one_in_each_part(count, random)) {
      while (particle + 1 != particles.end() && reached <= part * all) {
        reached += (++particle)->weight;
      }
      samples.push_back({particle->object, particle->T_object_robot});
    }
    return samples;
  }

  Marginals marginals(int object, const PoseLattice& lattice) const override {
    const PoseLattice grid = marginal_grid(lattice);
    Marginals sums{.grid = grid,
                   .xy = std::vector<double>(static_cast<std::size_t>(grid.plane())),
                   .theta = std::vector<double>(static_cast<std::size_t>(grid.theta_rad.count))};
    for (const ParticleFilter::Particle& particle : own_.particles()) {
      if (particle.object == object) {
        const std::int64_t bin = grid.bin_of(particle.T_object_robot);
        sums.xy[bin % grid.plane()] += particle.weight;
        sums.theta[bin / grid.plane()] += particle.weight;
      }
    }
    return sums;
  }

  std::vector<std::vector<BinShare>> likely_bins(std::span<const int> objects, double least_share,
                                                 PoseLattice& lattice) const override {
    const std::array<std::pair<Axis*, double>, 3> steps{{{&lattice.x_mm, parzen_step_mm},
                                                         {&lattice.y_mm, parzen_step_mm},
                                                         {&lattice.theta_rad, parzen_step_rad}}};
    for (const auto& [axis, step] : steps) {
      axis->count = std::max(1, static_cast<int>(std::ceil((axis->upper - axis->lower) / step)));
    }
    std::map<std::pair<int, std::int64_t>, double> weights;
    std::vector<double> all(static_cast<std::size_t>(*std::ranges::max_element(objects)) + 1);
    for (const ParticleFilter::Particle& particle : own_.particles()) {
      if (std::ranges::find(objects, particle.object) != objects.end()) {
        weights[{particle.object, lattice.bin_of(particle.T_object_robot)}] += particle.weight;
        all[particle.object] += particle.weight;
      }
    }
    std::vector<std::vector<BinShare>> likely(objects.size());
    for (const auto& [at, weight] : weights) {
      const double share = weight / all[at.first];
      if (share >= least_share) {
        const auto place = std::ranges::find(objects, at.first) - objects.begin();
        likely[place].push_back({at.second, share});
      }
    }
    return likely;
  }

  std::optional<double> effective_sample_size() const override {
    return own_.effective_sample_size();
  }
  std::vector<std::string> words() const override { return {words_}; }
  std::uint64_t device_bytes() const override { return own_.device_bytes(); }

 private:
  std::string words_;
};

/// The lattice of a filter's options, or the region where it has no bins.
template <typename Options>
auto& lattice_in(Options& options) {
  if constexpr (requires { options.lattice; }) {
    return options.lattice;
  } else {
    return options.region;
  }
}

FilterTraits traits(const HistogramOptions& histogram) {
  return {.bins = true,
          .every_bin = true,
          .touch_sd = histogram.touch_sd,
          .slip_sd = histogram.slip_sd,
          .none_weight = histogram.none_weight};
}
FilterTraits traits(const BoundedOptions& bounded) {
  return {.bins = true,
          .certificate = true,
          .touch_sd = bounded.touch_sd,
          .none_weight = bounded.none_weight,
          .tolerance = bounded.tolerance,
          .budget_s = bounded.budget_s};
}
FilterTraits traits(const ParticleOptions& /*particles*/) { return {}; }

constexpr int most_bins = 400;
constexpr int most_angles = 360;

Axis coarser(const Axis& axis) {
  const int width = (axis.count - 1) / most_bins + 1;  // in bins of the axis
  const int count = (axis.count - 1) / width + 1;
  Axis coarse{axis.lower, axis.lower + axis.step() * width * count, count};
  if (count * width == axis.count || coarse.upper > farthest_mm) {
    coarse.upper = axis.upper;
  }
  return coarse;
}

}  // namespace

FilterTraits traits_of(const FilterOptions& options) {
  return std::visit([](const auto& one) { return traits(one); }, options);
}

const PoseLattice& lattice_of(const FilterOptions& options) {
  return std::visit([](const auto& one) -> const PoseLattice& { return lattice_in(one); }, options);
}

const ContactModel& contact_of(const FilterOptions& options) {
  return std::visit([](const auto& one) -> const ContactModel& { return one.contact; }, options);
}

FilterOptions with_lattice(FilterOptions options, const PoseLattice& lattice) {
  std::visit([&](auto& one) { lattice_in(one) = lattice; }, options);
  return options;
}

std::string size_words(const FilterOptions& options) {
  if (const auto* particles = std::get_if<ParticleOptions>(&options)) {
    return fmt::format("{} particles", particles->particles);
  }
  const PoseLattice& lattice = lattice_of(options);
  return fmt::format("{} x {} x {} bins each{}", lattice.x_mm.count, lattice.y_mm.count,
                     lattice.theta_rad.count, traits_of(options).certificate ? " by bounds" : "");
}

std::unique_ptr<Filter> make_filter(Device* device, std::span<const Hypothesis> hypotheses,
                                    const FilterOptions& options, const FilterResources& search) {
  if (const auto* histogram = std::get_if<HistogramOptions>(&options)) {
    return std::make_unique<HistogramFilter>(PoseHistogram(*device, hypotheses, *histogram));
  }
  if (const auto* particles = std::get_if<ParticleOptions>(&options)) {
    return std::make_unique<Particles>(*device, hypotheses, *particles);
  }
  auto bounded = std::get<BoundedOptions>(options);
  bounded.threads = search.threads > 0 ? static_cast<int>(search.threads) : bounded.threads;
  bounded.cancel_point = search.cancel_point ? search.cancel_point : bounded.cancel_point;
  return std::make_unique<BoundedFilter>(hypotheses, bounded);
}

PoseLattice marginal_grid(const PoseLattice& lattice) {
  PoseLattice grid = lattice;
  grid.x_mm = coarser(lattice.x_mm);
  grid.y_mm = coarser(lattice.y_mm);
  // Not beyond the range, which may be a full circle.
  grid.theta_rad.count = std::min(lattice.theta_rad.count, most_angles);
  return grid;
}

}  // namespace palpate
