#include "estimation/lattice/touch_by_touch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "estimation/lattice/blur_tables.hpp"
#include "estimation/lattice/refinement.hpp"

namespace palpate {

namespace {

/// log of the sum of weight * sum over all objects.
double weighted_log_sum(std::span<const OverlapSum> sums, std::span<const double> log_weight) {
  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sums.size(); ++i) {
    largest = std::max(largest, log_weight[i] + sums[i].log_sum);
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    sum += std::exp(log_weight[i] + sums[i].log_sum - largest);
  }
  return largest + std::log(sum);
}

/// The number of bins, weighted by the objects' prior probabilities.
double weighted_bins(std::span<const OverlapSum> sums, std::span<const double> log_weight) {
  double bins = 0.0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    bins += std::exp(log_weight[i]) * static_cast<double>(sums[i].bins);
  }
  return bins;
}

}  // namespace

bool TouchByTouch::wanted_by(const HistogramOptions& options) {
  return !options.touch_sd.none() || !options.slip_sd.none() || options.none_weight;
}

std::uint64_t TouchByTouch::bytes_needed(const gpu::Context& context,
                                         const HistogramOptions& options, std::size_t objects) {
  const PoseLattice& lattice = options.lattice;
  return DenseBelief::bytes_needed(context, lattice, objects) +
         DisplacementBlur::bytes_needed(lattice, objects, options.touch_sd) +
         (options.slip_sd.none()
              ? 0
              : DisplacementBlur::bytes_needed(lattice, objects, options.slip_sd)) +
         (options.none_weight ? OverlapMean::bytes_needed(lattice, objects) : 0);
}

TouchByTouch::TouchByTouch(gpu::Context& context, gpu::CommandStream& stream,
                           const HistogramOptions& options, std::span<const Hypothesis> hypotheses,
                           const std::vector<double>& log_weight, DenseBelief& belief)
    : stream_(stream),
      options_(options),
      log_weight_(log_weight),
      objects_(hypotheses.size()),
      scratch_(belief.uniform()),
      touch_blur_(context, stream, options.lattice, objects_, options.touch_sd,
                  DisplacementBlur::Of::touch, options.none_weight.has_value()),
      lost_mass_(objects_, 0.0),
      references_(objects_) {
  for (const Hypothesis& hypothesis : hypotheses) {
    centroids_mm_.push_back(displaced_body(hypothesis.map).centroid_mm);
  }
  touch_blur_.warm_up(scratch_, belief);
  if (!options.slip_sd.none()) {
    slip_blur_.emplace(context, stream, options.lattice, objects_, options.slip_sd,
                       DisplacementBlur::Of::belief, false);
    slip_blur_->warm_up(scratch_, belief);
    slip_turns_ = slip_turns(options.lattice, centroids_mm_, slip_blur_->theta_steps());
    before_slip_ = belief.summarise();
    after_slip_ = before_slip_;
    largest_.reserve(objects_);
  }
  if (options.none_weight) {
    overlap_.emplace(context, stream, scratch_, hypotheses, options.lattice);
  }
  belief.clear();
}

void TouchByTouch::reset() {
  std::fill(lost_mass_.begin(), lost_mass_.end(), 0.0);
  none_log_evidence_ = 0.0;
  touched_ = false;
  felt_ = false;
}

void TouchByTouch::evaluate_planes(const std::function<void(const DenseBelief&)>& evaluate) {
  scratch_.clear();
  evaluate(scratch_);
  touch_blur_.blur_planes(scratch_, scratch_, references_);
}

void TouchByTouch::prepare(ContactEvidence evidence,
                           const std::function<void(const DenseBelief&)>& evaluate) {
  if (slip_blur_) {
    return;
  }
  prepared_.reset();
  evaluate_planes(evaluate);
  stream_.run();
  prepared_ = std::move(evidence);
}

void TouchByTouch::update(const Touch& touch, const ContactEvidence& evidence,
                          const std::function<void(const DenseBelief&)>& evaluate,
                          DenseBelief& belief) {
  if (slip_blur_ && touched_) {
    slip(belief);
  }
  const bool is_prepared = prepared_ == evidence;
  prepared_.reset();
  if (!is_prepared) {
    evaluate_planes(evaluate);
  }
  touch_turns_ =
      touch_turns(options_.lattice, touch.T_robot_sensor.translation_mm - options_.lattice.pivot_mm,
                  touch_blur_.theta_steps(), std::move(touch_turns_));
  touch_blur_.sum_turns(scratch_, touch_turns_, belief);
  // A touch without a known element says nothing, not even where the array was.
  if (overlap_ && !evidence.segments.empty()) {
    add_to_none(touch);
  }
  stream_.run();
  touched_ = true;
}

void TouchByTouch::slip(DenseBelief& belief) {
  before_slip_ = belief.summarise(std::move(before_slip_));
  largest_.clear();
  for (const BeliefSummary& summary : before_slip_) {
    largest_.push_back(summary.max);
  }
  slip_blur_->blur_planes(belief, scratch_, largest_);
  slip_blur_->sum_turns(scratch_, slip_turns_, belief);
  after_slip_ = belief.summarise(std::move(after_slip_));
  for (std::size_t i = 0; i < objects_; ++i) {
    const BeliefSummary& before = before_slip_[i];
    const BeliefSummary& after = after_slip_[i];
    lost_mass_[i] += before.max.value() - after.max.value() + std::log(before.sum / after.sum);
  }
}

void TouchByTouch::add_to_none(const Touch& touch) {
  const glm::dvec2& pivot_mm = options_.lattice.pivot_mm;
  std::span<const OverlapSum> sums = overlap_->sums(scratch_, touch, pivot_mm, false);
  if (weighted_bins(sums, log_weight_) == 0.0) {
    // No pose of the region brings the array to an object: all poses are alike.
    sums = overlap_->sums(scratch_, touch, pivot_mm, true);
  }
  const double bins = weighted_bins(sums, log_weight_);
  none_log_evidence_ += weighted_log_sum(sums, log_weight_) - std::log(bins);
  if (!felt_) {
    none_log_evidence_ += std::log(bins / static_cast<double>(options_.lattice.bins()));
    felt_ = true;
  }
}

std::uint64_t TouchByTouch::device_bytes() const {
  return scratch_.device_bytes() + touch_blur_.device_bytes() +
         (slip_blur_ ? slip_blur_->device_bytes() : 0) + (overlap_ ? overlap_->device_bytes() : 0);
}

}  // namespace palpate
