#include "expected_gain.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <future>
#include <numeric>
#include <thread>

#include <fmt/format.h>

#include "displacement_points.hpp"
#include "palpate/error.hpp"
#include "random.hpp"

namespace palpate {

namespace {

/// Columns that are summed at once: their sums stay in registers.
constexpr std::size_t lanes = 32;

/// Where touches are uncertain, so many displacements of each sample stand for all. The readings
/// come from one of them; their likelihood by the sample they came from is the mean over all of
/// them. Of every other sample the first counts alone: the mean over samples averages displacements
/// too, and its error is that of a mean over as many displacements as samples matter.
constexpr std::size_t displaced_copies = 8;

/// exp(x) within a part in 3e5, clamped to [exp(-87), exp(80)]; the compiler vectorises it.
float fast_exp(float x) {
  constexpr float per_octave = 1.44269504F;
  constexpr int offset = 200;  // makes a positive number, which conversion rounds down
  const float octaves = std::min(std::max(x, -87.0F), 80.0F) * per_octave;
  const int whole = static_cast<int>(octaves + (offset + 0.5F)) - offset;
  const float part = octaves - static_cast<float>(whole);
  const float mantissa =
      1.0F + part * (0.69314718F +
                     part * (0.24022651F +
                             part * (0.05550411F + part * (0.00961813F + part * 0.00133336F))));
  return mantissa * std::bit_cast<float>((whole + 127) << 23);
}

/// Samples of one label, which stand together.
struct LabelBlock {
  std::size_t first = 0;
  std::size_t end = 0;
};

/// The samples, and all the random numbers that every candidate shares.
struct SampledBelief {
  SampledBelief(std::span<const PoseSample> drawn, std::size_t elements,
                const DisplacementSd& touch_sd, const PlanOptions& options)
      : samples(drawn.begin(), drawn.end()), copies(touch_sd.none() ? 1 : displaced_copies) {
    const auto label = [&](const PoseSample& sample) {
      const auto object = static_cast<std::size_t>(sample.object);
      return options.label_of.empty() ? object : options.label_of[object];
    };
    std::ranges::stable_sort(samples, {}, label);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (i == 0 || label(samples[i]) != label(samples[i - 1])) {
        blocks.push_back({i, i});
      }
      blocks.back().end = i + 1;
      block_of.push_back(blocks.size() - 1);
    }
    if (touch_sd.none()) {
      displacements.resize(samples.size());
    } else {
      displacements = displacement_points(touch_sd, copies * samples.size());
    }
    Random random(options.seed, Stream::readings);
    draw_uniforms(elements, random);
  }

  /// Every element's numbers fall into `samples` equal parts, one into each (Latin hypercube):
  /// less noise than with independent numbers, and no bias.
  void draw_uniforms(std::size_t elements, Random& random) {
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

  std::vector<PoseSample> samples;  ///< ordered by label
  std::vector<LabelBlock> blocks;
  std::vector<std::size_t> block_of;  ///< [sample]
  std::size_t copies;                 ///< of each sample
  std::vector<Pose> displacements;    ///< [copy, sample]
  std::vector<float> uniforms;        ///< [sample, element] that decide the readings
};

/// One thread's work on candidates, with its memory.
class GainEstimator {
 public:
  GainEstimator(const ReadingPredictor& predictor, const SampledBelief& belief,
                std::span<const glm::dvec2> elements_mm)
      : predictor_(predictor),
        belief_(belief),
        elements_mm_(elements_mm),
        columns_((belief.samples.size() + lanes - 1) / lanes * lanes),
        logs_(elements_mm.size() * predictor.levels() * columns_),
        copy_rows_(elements_mm.size() * predictor.levels()),
        copy_logs_(belief.copies * copy_rows_),
        rows_(elements_mm.size()),
        sums_(columns_),
        relative_(columns_) {}

  TouchGain gain(const Pose& T_robot_sensor) {
    predict(T_robot_sensor);
    const std::size_t n = belief_.samples.size();
    double both = 0.0;
    double identity = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      predict_copies(i, T_robot_sensor);
      read(i);
      sum_columns();
      const Own own = own_likelihood(i);
      for (std::size_t j = 0; j < sums_.size(); ++j) {
        relative_[j] = fast_exp(sums_[j] - own.scale);
      }
      relative_[i] = static_cast<float>(own.mean);
      double all = 0.0;
      double alike = 0.0;
      for (std::size_t b = 0; b < belief_.blocks.size(); ++b) {
        const auto& [first, end] = belief_.blocks[b];
        const double sum =
            std::accumulate(relative_.begin() + static_cast<std::ptrdiff_t>(first),
                            relative_.begin() + static_cast<std::ptrdiff_t>(end), 0.0);
        all += sum;
        if (b == belief_.block_of[i]) {
          alike = sum / static_cast<double>(end - first);
        }
      }
      const double log_all = std::log(all / static_cast<double>(n));
      both += std::log(own.mean) - log_all;
      identity += std::log(alike) - log_all;
    }
    both /= static_cast<double>(n);
    identity /= static_cast<double>(n);
    return {.identity = identity, .pose = both - identity};
  }

 private:
  /// The likelihood of a reading by the sample it came from: mean * exp(scale).
  struct Own {
    float scale = 0.0F;
    double mean = 1.0;
  };

  Pose T_object_sensor(std::size_t copy, std::size_t i, const Pose& T_robot_sensor) const {
    return belief_.samples[i].T_object_robot * T_robot_sensor *
           belief_.displacements[copy * belief_.samples.size() + i];
  }

  /// Log-probabilities of all readings by the first copy of every sample.
  void predict(const Pose& T_robot_sensor) {
    for (std::size_t i = 0; i < belief_.samples.size(); ++i) {
      predictor_.predict(static_cast<std::size_t>(belief_.samples[i].object),
                         T_object_sensor(0, i, T_robot_sensor), elements_mm_,
                         std::span(logs_).subspan(i), columns_);
    }
  }

  /// The same by sample i's other copies.
  void predict_copies(std::size_t i, const Pose& T_robot_sensor) {
    for (std::size_t copy = 1; copy < belief_.copies; ++copy) {
      predictor_.predict(static_cast<std::size_t>(belief_.samples[i].object),
                         T_object_sensor(copy, i, T_robot_sensor), elements_mm_,
                         std::span(copy_logs_).subspan(copy * copy_rows_), 1);
    }
  }

  /// Simulates the readings by one of sample i's copies: the row of logs_ of each.
  void read(std::size_t i) {
    const std::size_t copy = i % belief_.copies;
    const float* const logs = copy == 0 ? logs_.data() + i : copy_logs_.data() + copy * copy_rows_;
    const std::size_t stride = copy == 0 ? columns_ : 1;
    const std::size_t levels = predictor_.levels();
    for (std::size_t e = 0; e < rows_.size(); ++e) {
      float left = belief_.uniforms[i * rows_.size() + e];
      std::size_t row = e * levels;
      const std::size_t last = row + levels - 1;
      for (; row < last; ++row) {
        left -= std::exp(logs[row * stride]);
        if (left < 0.0F) {
          break;
        }
      }
      rows_[e] = row;
    }
  }

  /// The readings' log-likelihoods by the first copy of every sample.
  void sum_columns() {
    for (std::size_t first = 0; first < sums_.size(); first += lanes) {
      std::array<float, lanes> sum{};
      for (const std::size_t row : rows_) {
        const float* const logs = logs_.data() + row * columns_ + first;
        for (std::size_t k = 0; k < lanes; ++k) {
          sum[k] += logs[k];
        }
      }
      std::copy(sum.begin(), sum.end(), sums_.begin() + static_cast<std::ptrdiff_t>(first));
    }
  }

  /// The readings' likelihood by the mean over sample i's copies.
  Own own_likelihood(std::size_t i) {
    std::array<float, displaced_copies> sums{};
    const std::span<float> by_copy(sums.data(), belief_.copies);
    by_copy[0] = sums_[i];
    for (std::size_t copy = 1; copy < by_copy.size(); ++copy) {
      for (const std::size_t row : rows_) {
        by_copy[copy] += copy_logs_[copy * copy_rows_ + row];
      }
    }
    Own own{.scale = *std::ranges::max_element(by_copy), .mean = 0.0};
    for (const float log_likelihood : by_copy) {
      own.mean += std::exp(log_likelihood - own.scale) / static_cast<double>(by_copy.size());
    }
    return own;
  }

  const ReadingPredictor& predictor_;
  const SampledBelief& belief_;
  std::span<const glm::dvec2> elements_mm_;
  std::size_t columns_;
  std::vector<float> logs_;  ///< [element, level, sample], of first copies
  std::size_t copy_rows_;
  std::vector<float> copy_logs_;   ///< [copy, element, level], of one sample; not of its first copy
  std::vector<std::size_t> rows_;  ///< [element] of the simulated reading
  std::vector<float> sums_;        ///< [sample]
  std::vector<float> relative_;    ///< [sample] likelihoods over the own sample's
};

}  // namespace

void require_plan(std::span<const Pose> T_robot_sensor, std::span<const glm::dvec2> elements_mm,
                  const PlanOptions& options, std::size_t objects) {
  constexpr std::size_t most_samples = 4096;
  if (T_robot_sensor.empty()) {
    throw Error(Fault::input, "no candidate touches: give at least one pose");
  }
  if (elements_mm.empty()) {
    throw Error(Fault::input, "the candidates' array has no living element: give at least one");
  }
  const auto is_finite = [](const glm::dvec2& p) {
    return std::isfinite(p.x) && std::isfinite(p.y);
  };
  for (std::size_t i = 0; i < T_robot_sensor.size(); ++i) {
    const Pose& pose = T_robot_sensor[i];
    if (!is_finite(pose.translation_mm) || !std::isfinite(pose.theta_rad)) {
      throw Error(Fault::input,
                  fmt::format("candidate {}: its pose [{}, {}, {}] is not finite; leave it out", i,
                              pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad));
    }
  }
  for (std::size_t i = 0; i < elements_mm.size(); ++i) {
    if (!is_finite(elements_mm[i])) {
      throw Error(Fault::input, fmt::format("element {} of the candidates' array: [{}, {}] mm is "
                                            "not finite; leave it out",
                                            i, elements_mm[i].x, elements_mm[i].y));
    }
  }
  if (options.samples < 2 || options.samples > most_samples) {
    throw Error(Fault::input,
                fmt::format("samples = {}: give 2 to {}", options.samples, most_samples));
  }
  if (!options.label_of.empty() && options.label_of.size() != objects) {
    throw Error(Fault::input, fmt::format("label_of: {} labels of {} objects; give one for each",
                                          options.label_of.size(), objects));
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

std::vector<TouchGain> expected_gain(const ReadingPredictor& predictor,
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
    GainEstimator estimator(predictor, belief, elements_mm);
    for (std::size_t i = next++; i < gains.size(); i = next++) {
      gains[i] = estimator.gain(T_robot_sensor[i]);
    }
  };
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
