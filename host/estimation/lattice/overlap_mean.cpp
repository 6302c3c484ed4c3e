#include "estimation/lattice/overlap_mean.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimation/kernel_sizes.hpp"
#include "shaders/sum_overlap.hpp"

namespace palpate {

namespace {

using gpu::Access;

/// Partial results of all slabs: one for each plane.
std::size_t partials_of(const PoseLattice& lattice, std::size_t objects) {
  return objects * static_cast<std::size_t>(lattice.theta_rad.count);
}

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

/// A length or place as a float of which sums of a few stay finite. No region reaches so far.
float within_floats(double mm) {
  constexpr double far_mm = 1e30;
  return std::isnan(mm) ? static_cast<float>(far_mm)
                        : static_cast<float>(std::clamp(mm, -far_mm, far_mm));
}

/// @param reuse memory for the result
std::vector<shaders::ArrayAtTheta> arrays_of(const Touch& touch, const PoseLattice& lattice,
                                             const glm::dvec2& pivot_mm,
                                             std::vector<shaders::ArrayAtTheta> reuse) {
  const glm::dvec2 from_pivot =
      touch.T_robot_sensor * bounding_box(touch.elements_mm).middle() - pivot_mm;
  std::vector<shaders::ArrayAtTheta> arrays = std::move(reuse);
  arrays.clear();
  for (int t = 0; t < lattice.theta_rad.count; ++t) {
    const double theta = lattice.theta_rad.centre(t);
    const glm::dvec2 turned = rotate(theta, from_pivot);
    const double direction = theta + touch.T_robot_sensor.theta_rad;
    arrays.push_back({within_floats(turned.x), within_floats(turned.y),
                      static_cast<float>(std::cos(direction)),
                      static_cast<float>(std::sin(direction))});
  }
  return arrays;
}

}  // namespace

OverlapMean::OverlapMean(gpu::Context& context, gpu::CommandStream& stream,
                         const DenseBelief& belief, std::span<const Hypothesis> hypotheses,
                         const PoseLattice& lattice)
    : stream_(stream),
      lattice_(lattice),
      objects_(hypotheses.size()),
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
      partials_(context, partials_of(lattice, objects_) * sizeof(shaders::OverlapPartial),
                gpu::Memory::device, "sums of planes"),
      read_partials_(partials_of(lattice, objects_)) {
  // The first run, at which drivers compile the kernel.
  const std::vector<glm::dvec2> origin(1);
  sums(belief, {.elements_mm = origin, .pressure = {}}, {0.0, 0.0}, false);
}

std::uint64_t OverlapMean::bytes_needed(const PoseLattice& lattice, std::size_t objects) {
  const auto thetas = static_cast<std::uint64_t>(lattice.theta_rad.count);
  return gpu::allocated(thetas * sizeof(shaders::ArrayAtTheta)) +
         gpu::allocated(objects * sizeof(shaders::ObjectBox)) +
         gpu::allocated(partials_of(lattice, objects) * sizeof(shaders::OverlapPartial));
}

std::uint64_t OverlapMean::device_bytes() const {
  return arrays_.bytes() + boxes_.bytes() + partials_.bytes();
}

std::span<const OverlapSum> OverlapMean::sums(const DenseBelief& scratch, const Touch& touch,
                                              const glm::dvec2& pivot_mm, bool everywhere) {
  placed_ = arrays_of(touch, lattice_, pivot_mm, std::move(placed_));
  stream_.upload(arrays_, placed_);
  // Half a float's largest: sums of two stay finite.
  constexpr float unbounded = std::numeric_limits<float>::max() / 8.0F;
  const glm::dvec2 half = bounding_box(touch.elements_mm).extent() / 2.0;
  std::uint32_t first = 0;
  for (const Slab& slab : scratch.slabs()) {
    const shaders::OverlapPush push{.slab = planes_of(slab, lattice_.theta_rad.count),
                                    .partial_first = first,
                                    .first_x_mm = static_cast<float>(lattice_.x_mm.centre(0)),
                                    .first_y_mm = static_cast<float>(lattice_.y_mm.centre(0)),
                                    .step_x_mm = static_cast<float>(lattice_.x_mm.step()),
                                    .step_y_mm = static_cast<float>(lattice_.y_mm.step()),
                                    .half_x_mm = everywhere ? unbounded : within_floats(half.x),
                                    .half_y_mm = everywhere ? unbounded : within_floats(half.y)};
    stream_.dispatch(kernel_, {&slab.log_likelihood, &arrays_, &boxes_, &partials_}, push,
                     {slab.theta_count, slab.object_count, 1},
                     static_cast<double>(slab.object_count * slab.bins()));
    first += slab.theta_count * slab.object_count;
  }
  stream_.download(partials_, read_partials_);
  stream_.run();

  largest_.assign(objects_, -std::numeric_limits<double>::infinity());
  sum_.assign(objects_, 0.0);
  sums_.assign(objects_, {});
  const auto for_each_partial = [&](const auto& take) {
    const shaders::OverlapPartial* partial = read_partials_.data();
    for (const Slab& slab : scratch.slabs()) {
      for (std::uint32_t i = 0; i < slab.object_count; ++i) {
        for (std::uint32_t t = 0; t < slab.theta_count; ++t, ++partial) {
          if (partial->bins > 0) {
            take(slab.object_first + i, *partial);
          }
        }
      }
    }
  };
  for_each_partial([&](std::size_t object, const shaders::OverlapPartial& partial) {
    largest_[object] = std::max<double>(largest_[object], partial.max);
  });
  for_each_partial([&](std::size_t object, const shaders::OverlapPartial& partial) {
    sum_[object] += partial.sum * std::exp(partial.max - largest_[object]);
    sums_[object].bins += partial.bins;
  });
  for (std::size_t i = 0; i < objects_; ++i) {
    sums_[i].log_sum = largest_[i] + std::log(sum_[i]);
  }
  return sums_;
}

}  // namespace palpate
