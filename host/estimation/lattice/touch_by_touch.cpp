#include "estimation/lattice/touch_by_touch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimation/kernel_sizes.hpp"
#include "estimation/lattice/refinement.hpp"
#include "shaders/sum_overlap.hpp"

namespace palpate {

namespace {

using gpu::Access;

std::vector<shaders::ObjectBox> boxes_of(std::span<const Hypothesis> hypotheses) {
  std::vector<shaders::ObjectBox> boxes;
  for (const Hypothesis& hypothesis : hypotheses) {
    const BoundingBox box = occupied_box(hypothesis.map);
    const glm::dvec2 half = box.extent() / 2.0;
    boxes.push_back({static_cast<float>(box.middle().x), static_cast<float>(box.middle().y),
                     static_cast<float>(half.x), static_cast<float>(half.y)});
  }
  return boxes;
}

/// @param reuse memory for the result
std::vector<shaders::ArrayAtTheta> arrays_of(const ArrayRectangle& array,
                                             const PoseLattice& lattice,
                                             std::vector<shaders::ArrayAtTheta> reuse) {
  std::vector<shaders::ArrayAtTheta> arrays = std::move(reuse);
  arrays.clear();
  for (int t = 0; t < lattice.theta_rad.count; ++t) {
    const double theta = lattice.theta_rad.centre(t);
    const glm::vec2 turned = rotate(theta, array.from_pivot_mm);
    const double direction = theta + array.direction_rad;
    arrays.push_back({turned.x, turned.y, static_cast<float>(std::cos(direction)),
                      static_cast<float>(std::sin(direction))});
  }
  return arrays;
}

}  // namespace

bool TouchByTouch::wanted_by(const HistogramOptions& options) {
  return !options.touch_sd.none() || !options.slip_sd.none() || options.none_weight;
}

TouchByTouch::TouchByTouch(gpu::Context& context, gpu::CommandStream& stream,
                           const HistogramOptions& options, std::span<const Hypothesis> hypotheses,
                           const std::vector<double>& log_weight, DenseBelief& belief)
    : stream_(stream),
      options_(options),
      objects_(hypotheses.size()),
      scratch_(belief.uniform()),
      touch_blur_(context, stream, options.lattice, objects_, options.touch_sd, {}),
      lost_mass_(objects_, 0.0),
      references_(objects_) {
  touch_blur_.warm_up(scratch_, belief);
  if (!options.slip_sd.none()) {
    std::vector<glm::dvec2> centroids_mm;
    for (const Hypothesis& hypothesis : hypotheses) {
      centroids_mm.push_back(displaced_body(hypothesis.map).centroid_mm);
    }
    slip_blur_.emplace(context, stream, options.lattice, objects_, options.slip_sd, centroids_mm);
    slip_blur_->warm_up(scratch_, belief);
    before_slip_ = belief.summarise();
    after_slip_ = before_slip_;
    largest_.reserve(objects_);
  }
  if (options.none_weight) {
    overlap_.emplace(context, stream, scratch_, hypotheses, log_weight, options.lattice);
  }
  belief.clear();
}

void TouchByTouch::reset() {
  std::fill(lost_mass_.begin(), lost_mass_.end(), 0.0);
  none_log_evidence_ = 0.0;
  touched_ = false;
  felt_ = false;
}

void TouchByTouch::update(const TouchEvidence& touch,
                          const std::function<void(const DenseBelief&)>& evaluate,
                          DenseBelief& belief) {
  if (slip_blur_ && touched_) {
    slip(belief);
  }
  scratch_.clear();
  evaluate(scratch_);
  const glm::dvec2& pivot_mm = options_.lattice.pivot_mm;
  // A touch without a known element says nothing, not even where the array was. A displacement
  // moves likelihood between neighbouring bins: it changes their sum at the edge of the overlap
  // alone, and is left out of it.
  if (overlap_ && touch.tells()) {
    add_to_none(array_rectangle(touch.T_robot_sensor, touch.elements_mm, pivot_mm));
  }
  touch_blur_.blur_planes(scratch_, scratch_, references_);
  touch_blur_.turn_for(touch.T_robot_sensor.translation_mm - pivot_mm);
  touch_blur_.sum_turns(scratch_, belief);
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
  slip_blur_->sum_turns(scratch_, belief);
  after_slip_ = belief.summarise(std::move(after_slip_));
  for (std::size_t i = 0; i < objects_; ++i) {
    const BeliefSummary& before = before_slip_[i];
    const BeliefSummary& after = after_slip_[i];
    lost_mass_[i] += before.max.value() - after.max.value() + std::log(before.sum / after.sum);
  }
}

void TouchByTouch::add_to_none(const ArrayRectangle& array) {
  OverlapSum all = overlap_->sum(scratch_, array, false);
  if (all.bins == 0.0) {
    // No pose of the region brings the array to an object: all poses are alike.
    all = overlap_->sum(scratch_, array, true);
  }
  none_log_evidence_ += all.log_sum - std::log(all.bins);
  if (!felt_) {
    none_log_evidence_ += std::log(all.bins / static_cast<double>(options_.lattice.bins()));
    felt_ = true;
  }
}

std::uint64_t TouchByTouch::device_bytes() const {
  return scratch_.device_bytes() + touch_blur_.device_bytes() +
         (slip_blur_ ? slip_blur_->device_bytes() : 0) + (overlap_ ? overlap_->device_bytes() : 0);
}

OverlapMean::OverlapMean(gpu::Context& context, gpu::CommandStream& stream,
                         const DenseBelief& belief, std::span<const Hypothesis> hypotheses,
                         const std::vector<double>& log_weight, const PoseLattice& lattice)
    : stream_(stream),
      log_weight_(log_weight),
      lattice_(lattice),
      kernel_(context, {.name = "sum_overlap",
                        .spirv = shaders::sum_overlap,
                        .bindings = {Access::table, Access::table, Access::table, Access::storage},
                        .push_bytes = sizeof(shaders::OverlapPush),
                        .constants = {independent_lanes(context.limits())}}),
      arrays_(context,
              static_cast<std::size_t>(lattice.theta_rad.count) * sizeof(shaders::ArrayAtTheta),
              gpu::Memory::device, "arrays", VK_FORMAT_R32G32B32A32_SFLOAT),
      boxes_(
          stream.uploaded(boxes_of(hypotheses), "boxes of objects", VK_FORMAT_R32G32B32A32_SFLOAT)),
      read_partials_(hypotheses.size() * static_cast<std::size_t>(lattice.theta_rad.count)),
      partials_(context, std::span(read_partials_).size_bytes(), gpu::Memory::device,
                "sums of planes") {
  // The first run, at which drivers compile the kernel.
  sum(belief, {}, false);
}

std::uint64_t OverlapMean::device_bytes() const {
  return arrays_.bytes() + boxes_.bytes() + partials_.bytes();
}

OverlapSum OverlapMean::sum(const DenseBelief& scratch, const ArrayRectangle& array,
                            bool everywhere) {
  placed_ = arrays_of(array, lattice_, std::move(placed_));
  stream_.upload(arrays_, placed_);
  // Half a float's largest: sums of two stay finite.
  constexpr float unbounded = std::numeric_limits<float>::max() / 8.0F;
  const glm::vec2 half = everywhere ? glm::vec2(unbounded) : glm::vec2(array.half_mm);
  std::uint32_t first = 0;
  for (const Slab& slab : scratch.slabs()) {
    const shaders::OverlapPush push{.slab = planes_of(slab, lattice_.theta_rad.count),
                                    .partial_first = first,
                                    .first_x_mm = static_cast<float>(lattice_.x_mm.centre(0)),
                                    .first_y_mm = static_cast<float>(lattice_.y_mm.centre(0)),
                                    .step_x_mm = static_cast<float>(lattice_.x_mm.step()),
                                    .step_y_mm = static_cast<float>(lattice_.y_mm.step()),
                                    .half_x_mm = half.x,
                                    .half_y_mm = half.y};
    stream_.dispatch(kernel_, {&slab.log_likelihood, &arrays_, &boxes_, &partials_}, push,
                     {slab.theta_count, slab.object_count, 1});
    first += slab.theta_count * slab.object_count;
  }
  stream_.download(partials_, read_partials_);
  stream_.run();

  of_objects_.assign(log_weight_.size(), {});
  const auto for_each_partial = [&](const auto& take) {
    const shaders::OverlapPartial* partial = read_partials_.data();
    for (const Slab& slab : scratch.slabs()) {
      for (std::uint32_t i = 0; i < slab.object_count; ++i) {
        for (std::uint32_t t = 0; t < slab.theta_count; ++t, ++partial) {
          if (partial->bins > 0) {
            take(of_objects_[slab.object_first + i], *partial);
          }
        }
      }
    }
  };
  for_each_partial([](ObjectSum& of, const shaders::OverlapPartial& partial) {
    of.largest = std::max<double>(of.largest, partial.max);
  });
  for_each_partial([](ObjectSum& of, const shaders::OverlapPartial& partial) {
    of.sum += partial.sum * std::exp(partial.max - of.largest);
    of.bins += partial.bins;
  });
  OverlapSum all{.log_sum = -std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < of_objects_.size(); ++i) {
    ObjectSum& of = of_objects_[i];
    of.log_sum = log_weight_[i] + (of.largest + std::log(of.sum));
    all.log_sum = std::max(all.log_sum, of.log_sum);
    all.bins += std::exp(log_weight_[i]) * static_cast<double>(of.bins);
  }
  double sum = 0.0;
  for (const ObjectSum& of : of_objects_) {
    sum += std::exp(of.log_sum - all.log_sum);
  }
  all.log_sum += std::log(sum);
  return all;
}

}  // namespace palpate
