#include "recogniser.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "palpate/balanced_lattice.hpp"
#include "palpate/particle_filter.hpp"

namespace palpate::cli {

namespace {

class HistogramRecogniser : public Recogniser {
 public:
  HistogramRecogniser(Device& device, const RecognitionTask& task)
      : histogram_(device, task.hypotheses, task.histogram) {}

  void reset() override { histogram_.reset(); }
  void update(std::span<const Touch> touches,
              const std::function<void(double)>& progress) override {
    histogram_.update(touches, progress);
  }
  void prepare(const Touch& touch) override { histogram_.prepare(touch); }
  Estimate estimate() const override { return histogram_.estimate(); }
  std::optional<RefinedPose> refine(const Mode& mode) const override {
    return histogram_.refine(mode);
  }
  std::optional<double> effective_sample_size() const override { return {}; }
  Marginals marginals(int object) const override { return histogram_.marginals(object); }
  std::string description() const override {
    const PoseLattice& lattice = histogram_.lattice();
    return fmt::format("{} x {} x {} bins each, in {}", lattice.x_mm.count, lattice.y_mm.count,
                       lattice.theta_rad.count, fmt::join(histogram_.paths(), "; "));
  }
  const PoseHistogram* histogram() const override { return &histogram_; }

 private:
  PoseHistogram histogram_;
};

class ParticleRecogniser : public Recogniser {
 public:
  ParticleRecogniser(Device& device, const RecognitionTask& task)
      : options_(*task.particles), filter_(device, task.hypotheses, options_) {}

  void reset() override { filter_.reset(); }
  void update(std::span<const Touch> touches,
              const std::function<void(double)>& progress) override {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      filter_.update(touches[i]);
      progress(static_cast<double>(i + 1) / static_cast<double>(touches.size()));
    }
  }
  void prepare(const Touch&) override {}  // what weighs particles also moves and draws them
  Estimate estimate() const override { return filter_.estimate(); }
  std::optional<RefinedPose> refine(const Mode&) const override { return {}; }
  std::optional<double> effective_sample_size() const override {
    return filter_.effective_sample_size();
  }
  Marginals marginals(int object) const override {
    const PoseLattice& grid = options_.region;
    Marginals sums{.grid = grid,
                   .xy = std::vector<double>(static_cast<std::size_t>(grid.plane())),
                   .theta = std::vector<double>(static_cast<std::size_t>(grid.theta_rad.count))};
    for (const ParticleFilter::Particle& particle : filter_.particles()) {
      if (particle.object == object) {
        const std::int64_t bin = grid.bin_of(particle.T_object_robot);
        sums.xy[bin % grid.plane()] += particle.weight;
        sums.theta[bin / grid.plane()] += particle.weight;
      }
    }
    return sums;
  }
  std::string description() const override {
    return fmt::format(
        "{} particles, {} resampling{}, seed {}", options_.particles,
        options_.resampling == Resampling::multinomial ? "multinomial" : "systematic",
        options_.augmented ? ", random particles added" : "", options_.seed);
  }
  const PoseHistogram* histogram() const override { return nullptr; }

 private:
  ParticleOptions options_;
  ParticleFilter filter_;
};

/// Counts for --bins auto: what the maps are worth and the device holds.
PoseLattice choose_bins(const RecognitionTask& task, const Device& device) {
  const HistogramOptions& histogram = task.histogram;
  const std::int64_t most = most_bins_on(device, histogram.still_array);
  const BalancedLattice chosen = balanced_lattice(histogram.lattice, task.hypotheses, most);
  if (chosen.coarsened) {
    fmt::print(stderr,
               "palpate: --bins auto: steps of {:.2f} mm, coarser than the maps are worth, to keep "
               "to {} bins in all; narrow the region, or give --bins\n",
               chosen.step_mm, most);
  }
  return chosen.lattice;
}

}  // namespace

void settle_bins(const Device& device, RecognitionTask& task) {
  if (!task.auto_bins) {
    return;
  }
  task.histogram.lattice = choose_bins(task, device);
  if (task.particles) {  // of which pictures count how many lie in each bin
    task.particles->region = task.histogram.lattice;
  }
  task.auto_bins = false;
}

std::unique_ptr<Recogniser> make_recogniser(Device& device, const RecognitionTask& task) {
  if (task.particles) {
    return std::make_unique<ParticleRecogniser>(device, task);
  }
  return std::make_unique<HistogramRecogniser>(device, task);
}

}  // namespace palpate::cli
