#include "estimation/lattice/expected_gain.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <future>
#include <numbers>
#include <numeric>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "model/displacement_points.hpp"
#include "model/random.hpp"
#include "model/refuse.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

namespace {

/// Columns that are summed at once: their sums stay in registers.
constexpr std::size_t lanes = 32;

/// The displacements that stand for all where touches are displaced: means over them are those over
/// the distribution, of polynomials up to the third degree (Stroud 1957). They are the same for
/// every sample, so that what tells displacements apart tells no samples apart.
std::vector<Pose> few_displacements(const DisplacementSd& sd) {
  if (sd.none()) {
    return {Pose{}};
  }
  std::vector<Pose> few;
  for (const double at : {-std::numbers::sqrt3, std::numbers::sqrt3}) {
    few.insert(few.end(), {{{at * sd.mm, 0.0}, 0.0}, {{0.0, at * sd.mm}, 0.0}, {{}, at * sd.rad}});
  }
  return few;
}

/// exp(x) within a part in 3e5, clamped to about [exp(-87), exp(88)]. Without comparisons of
/// floats, which may trap, the compiler vectorises it.
float fast_exp(float x) {
  constexpr float per_octave = 1.44269504F;
  constexpr int offset = 1 << 16;  // makes a positive number, which conversion rounds down
  const float octaves = x * per_octave;
  const int whole = static_cast<int>(octaves + (offset + 0.5F)) - offset;
  const float part = octaves - static_cast<float>(whole);
  const float mantissa =
      1.0F + part * (0.69314718F +
                     part * (0.24022651F +
                             part * (0.05550411F + part * (0.00961813F + part * 0.00133336F))));
  return mantissa * std::bit_cast<float>((std::clamp(whole, -126, 127) + 127) << 23);
}

/// The samples, and all the random numbers that every candidate shares.
struct SampledBelief {
  SampledBelief(std::span<const PoseSample> drawn, std::size_t elements,
                const DisplacementSd& touch_sd, const PlanOptions& options)
      : samples(drawn.begin(), drawn.end()), displacements(few_displacements(touch_sd)) {
    const auto label = [&](const PoseSample& sample) {
      const auto object = static_cast<std::size_t>(sample.object);
      return options.label_of.empty() ? object : options.label_of[object];
    };
    std::ranges::stable_sort(samples, {}, label);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (i == 0 || label(samples[i]) != label(samples[i - 1])) {
        blocks.emplace_back(i, i);
      }
      blocks.back().second = i + 1;
    }
    // Every element's numbers fall into `samples` equal parts, one into each (Latin hypercube):
    // less noise than with independent numbers, and no bias.
    Random random(options.seed, Stream::readings);
    const std::size_t n = samples.size();
    uniforms.resize(n * elements);
    std::vector<std::size_t> part(n);
    std::iota(part.begin(), part.end(), std::size_t{0});
    for (std::size_t e = 0; e < elements; ++e) {
      for (std::size_t i = n; i > 1; --i) {  // Fisher and Yates
        const double other = random.uniform() * static_cast<double>(i);
        std::swap(part[i - 1], part[static_cast<std::size_t>(other)]);
      }
      for (std::size_t i = 0; i < n; ++i) {
        const double at =
            (static_cast<double>(part[i]) + random.uniform()) / static_cast<double>(n);
        uniforms[i * elements + e] = static_cast<float>(at);
      }
    }
  }

  std::vector<PoseSample> samples;                          ///< ordered by label
  std::vector<std::pair<std::size_t, std::size_t>> blocks;  ///< [label] first sample and end
  std::vector<Pose> displacements;                          ///< of equal probability
  std::vector<float> uniforms;  ///< [sample, element] that decide the readings
};

/// The mean of terms, and its standard error.
struct Mean {
  void add(double term) {
    sum += term;
    squares += term * term;
    ++count;
  }
  double mean() const { return sum / count; }
  double standard_error() const {
    return std::sqrt(std::max(squares - sum * mean(), 0.0) / (count - 1.0) / count);
  }

  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
};

/// One thread's work on candidates, with its memory.
class GainEstimator {
 public:
  GainEstimator(const PredictedReadings& predicted, const SampledBelief& belief,
                std::span<const glm::dvec2> elements_mm)
      : predicted_(predicted),
        belief_(belief),
        elements_mm_(elements_mm),
        columns_((belief.samples.size() + lanes - 1) / lanes * lanes),
        copies_(belief.displacements.size()),
        copy_size_(elements_mm.size() * predicted.levels() * columns_),
        of_sample_(elements_mm.size() * predicted.levels()),
        logs_(copies_ * copy_size_),
        rows_(elements_mm.size()),
        sums_(copies_ * columns_),
        likelihoods_(columns_),
        log_likelihoods_(columns_) {}

  TouchGain gain(const Pose& T_robot_sensor) {
    predict(T_robot_sensor);
    Mean identity;
    Mean pose;
    Mean both;
    const std::size_t n = belief_.samples.size();
    // Where every sample has several copies, half of the readings are enough.
    const std::size_t step = copies_ > 1 && n >= 4 ? 2 : 1;
    for (std::size_t i = 0, copy = 0; i < n; i += step, copy = (copy + 1) % copies_) {
      read(i, copy);
      sum_columns();
      weigh(sums_[copy * columns_ + i]);
      const Divergence told = divergence();
      identity.add(told.identity);
      pose.add(told.pose);
      both.add(told.identity + told.pose);
    }
    return {.identity = identity.mean(),
            .pose = pose.mean(),
            .standard_error = {identity.standard_error(), pose.standard_error(),
                               both.standard_error()}};
  }

 private:
  /// Kullback-Leibler divergence of the belief after a reading from the belief before it, nats.
  struct Divergence {
    double identity = 0.0;  ///< of the labels
    double pose = 0.0;      ///< of the samples of each label, on average
  };

  /// Log-probabilities of all readings by every sample.
  void predict(const Pose& T_robot_sensor) {
    for (std::size_t copy = 0; copy < copies_; ++copy) {
      const Pose displaced = T_robot_sensor * belief_.displacements[copy];
      for (std::size_t i = 0; i < belief_.samples.size(); ++i) {
        const PoseSample& sample = belief_.samples[i];
        predicted_.of(static_cast<std::size_t>(sample.object))
            .all_readings(elements_mm_, sample.T_object_robot * displaced, of_sample_);
        float* out = logs_.data() + copy * copy_size_ + i;
        for (const double log : of_sample_) {
          *out = static_cast<float>(log);
          out += columns_;
        }
      }
    }
  }

  /// Simulates the readings by a copy of sample i: the row of logs_ of each.
  void read(std::size_t i, std::size_t copy) {
    const float* const logs = logs_.data() + copy * copy_size_ + i;
    const std::size_t levels = predicted_.levels();
    for (std::size_t e = 0; e < rows_.size(); ++e) {
      float left = belief_.uniforms[i * rows_.size() + e];
      std::size_t row = e * levels;
      const std::size_t last = row + levels - 1;
      for (; row < last; ++row) {
        left -= std::exp(logs[row * columns_]);
        if (left < 0.0F) {
          break;
        }
      }
      rows_[e] = row;
    }
  }

  /// The readings' log-likelihoods by every copy of every sample.
  void sum_columns() {
    float* out = sums_.data();
    for (std::size_t copy = 0; copy < copies_; ++copy) {
      for (std::size_t first = 0; first < columns_; first += lanes) {
        std::array<float, lanes> sum{};
        for (const std::size_t row : rows_) {
          const float* const logs = logs_.data() + copy * copy_size_ + row * columns_ + first;
          for (std::size_t k = 0; k < lanes; ++k) {
            sum[k] += logs[k];
          }
        }
        out = std::copy(sum.begin(), sum.end(), out);
      }
    }
  }

  /// The readings' likelihoods by every sample, summed over its copies, relative to exp(scale).
  void weigh(float scale) {
    std::ranges::fill(likelihoods_, 0.0F);
    for (std::size_t first = 0; first < sums_.size(); first += columns_) {
      for (std::size_t j = 0; j < columns_; ++j) {
        likelihoods_[j] += fast_exp(sums_[first + j] - scale);
      }
    }
    for (std::size_t j = 0; j < columns_; ++j) {
      log_likelihoods_[j] = copies_ == 1 ? sums_[j] - scale : std::log(likelihoods_[j]);
    }
  }

  /// What the weighed readings tell.
  Divergence divergence() const {
    double all = 0.0;
    double identity = 0.0;
    double pose = 0.0;
    for (const auto& [first, end] : belief_.blocks) {
      double sum = 0.0;
      double logs = 0.0;
      for (std::size_t j = first; j < end; ++j) {
        const double likelihood = likelihoods_[j];
        sum += likelihood;
        logs += likelihood * log_likelihoods_[j];
      }
      const double log_mean = std::log(sum / static_cast<double>(end - first));
      all += sum;
      identity += sum * log_mean;
      pose += logs - sum * log_mean;
    }
    const double log_all = std::log(all / static_cast<double>(belief_.samples.size()));
    // Only rounding makes a divergence negative.
    return {.identity = std::max(identity / all - log_all, 0.0), .pose = std::max(pose / all, 0.0)};
  }

  const PredictedReadings& predicted_;
  const SampledBelief& belief_;
  std::span<const glm::dvec2> elements_mm_;
  std::size_t columns_;
  std::size_t copies_;                  ///< of every sample: displacements
  std::size_t copy_size_;               ///< numbers of one copy in logs_
  std::vector<double> of_sample_;       ///< [element, level]
  std::vector<float> logs_;             ///< [copy, element, level, sample]
  std::vector<std::size_t> rows_;       ///< [element] of the simulated reading
  std::vector<float> sums_;             ///< [copy, sample]
  std::vector<float> likelihoods_;      ///< [sample] relative to that of the copy that was read
  std::vector<float> log_likelihoods_;  ///< [sample]
};

}  // namespace

PredictedReadings::PredictedReadings(std::span<const Hypothesis> hypotheses,
                                     const ContactModel& contact) {
  const ContactModel model = predictive(contact);
  for (const Hypothesis& hypothesis : hypotheses) {
    maps_.push_back(hypothesis.compared());
  }
  for (const OccupancyGrid& map : maps_) {
    on_map_.emplace_back(map, model, on_map_.size());
  }
}

void require_plan(std::span<const Pose> T_robot_sensor, std::span<const glm::dvec2> elements_mm,
                  const PlanOptions& options, std::size_t objects) {
  if (T_robot_sensor.empty()) {
    throw Error(Fault::input, "no candidate touches: give at least one pose");
  }
  if (elements_mm.empty()) {
    throw Error(Fault::input, "the candidates' array has no living element: give at least one");
  }
  for (std::size_t i = 0; i < T_robot_sensor.size(); ++i) {
    if (const auto& [mm, rad] = T_robot_sensor[i]; !is_finite(T_robot_sensor[i])) {
      refuse(fmt::format("candidate {}", i), "its pose [{}, {}, {}] is not finite; leave it out",
             mm.x, mm.y, rad);
    }
  }
  for (std::size_t i = 0; i < elements_mm.size(); ++i) {
    const glm::dvec2& mm = elements_mm[i];
    if (!std::isfinite(mm.x) || !std::isfinite(mm.y)) {
      refuse(fmt::format("element {} of the candidates' array", i),
             "[{}, {}] mm is not finite; leave it out", mm.x, mm.y);
    }
  }
  require(options.samples >= 2 && options.samples <= 4096, "samples",
          static_cast<double>(options.samples), "give 2 to 4096");
  if (!options.label_of.empty() && options.label_of.size() != objects) {
    refuse("label_of", "{} labels of {} objects; give one for each", options.label_of.size(),
           objects);
  }
}

void slip(std::span<PoseSample> samples, std::span<const Body> bodies, const DisplacementSd& sd,
          std::uint64_t seed) {
  if (sd.none()) {
    return;
  }
  Random random(seed, Stream::slips);
  for (PoseSample& sample : samples) {
    const glm::dvec2 centroid_mm = bodies[static_cast<std::size_t>(sample.object)].centroid_mm;
    sample.T_object_robot =
        slipped(sample.T_object_robot, random_displacement(sd, random), centroid_mm);
  }
}

std::vector<TouchGain> expected_gain(const PredictedReadings& predicted,
                                     std::span<const PoseSample> samples,
                                     std::span<const Pose> T_robot_sensor,
                                     std::span<const glm::dvec2> elements_mm,
                                     const DisplacementSd& touch_sd, const PlanOptions& options) {
  const SampledBelief belief(samples, elements_mm.size(), touch_sd, options);
  std::vector<TouchGain> gains(T_robot_sensor.size());
  // Candidates do not depend on each other: the number of threads changes no bit.
  constexpr std::size_t fewest_candidates = 8;  // that are worth a thread
  const std::size_t threads =
      std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1,
                              (gains.size() + fewest_candidates - 1) / fewest_candidates);
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    GainEstimator estimator(predicted, belief, elements_mm);
    for (std::size_t i = next++; i < gains.size(); i = next++) {
      gains[i] = estimator.gain(T_robot_sensor[i]);
    }
  };
  // Not oneTBB's threads, whose synchronisation ThreadSanitizer does not see.
  std::vector<std::future<void>> others;
  for (std::size_t i = 1; i < threads; ++i) {
    others.push_back(std::async(std::launch::async, work));
  }
  work();
  for (std::future<void>& other : others) {
    other.get();
  }
  return gains;
}

}  // namespace palpate
