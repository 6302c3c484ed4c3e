#include "baselines.hpp"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/kernel_inputs.hpp"
#include "estimation/kernel_sizes.hpp"
#include "estimation/known_elements.hpp"
#include "one_bin.hpp"
#include "one_bin_push.h"

namespace palpate::bench {

namespace {

constexpr std::uint32_t workgroup = 64;
constexpr std::size_t longest_run = 64;  // summed in one float, as in the product

gpu::Kernel make_kernel(gpu::Context& context, const ContactModel& model) {
  const std::vector<gpu::Access> bindings(5, gpu::Access::storage);
  const std::vector<std::uint32_t> constants{
      workgroup, std::bit_cast<std::uint32_t>(static_cast<float>(model.gamma * *model.prior)),
      std::bit_cast<std::uint32_t>(static_cast<float>(1.0 - model.gamma))};
  return {context,
          {.name = "one_bin",
           .spirv = shaders::one_bin,
           .bindings = bindings,
           .push_bytes = sizeof(shaders::OneBinPush),
           .constants = constants}};
}

}  // namespace

OneBinKernel::OneBinKernel(Device& device, std::span<const Hypothesis> hypotheses,
                           const PoseLattice& lattice, const ContactModel& model)
    : context_(device.context()),
      stream_(context_),
      kernel_(make_kernel(context_, model)),
      lattice_(lattice),
      cell_mm_(hypotheses.front().map.cell_mm) {
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.map;
    objects_.push_back({.width = map.nx + 2 * shaders::MAP_BORDER,
                        .height = map.ny + 2 * shaders::MAP_BORDER,
                        .map = stream_.uploaded(with_border(map, *model.prior), "a map"),
                        .axes = stream_.uploaded(axes_in_cells(map, lattice), "the lattice's axes"),
                        .belief = gpu::Buffer(
                            context_, static_cast<VkDeviceSize>(lattice.bins()) * sizeof(TwoFloat),
                            gpu::Memory::device, "pose bins")});
    stream_.fill(objects_.back().belief, 0);
  }
  stream_.run();
}

void OneBinKernel::update(std::span<const Touch> touches) {
  const KnownElements known =
      gathered(evidence_of(touches, ContactModel{}), lattice_.pivot_mm, longest_run);
  std::vector<shaders::Segment> runs;
  for (const ReadingRun& run : known.runs) {
    runs.push_back(segment_of(run));
  }
  const gpu::Buffer elements = stream_.uploaded(
      rotated_elements(known.from_pivot_mm, lattice_.theta_rad, cell_mm_), "elements");
  const gpu::Buffer segments = stream_.uploaded(runs, "segments");
  for (const Object& object : objects_) {
    const shaders::OneBinPush push{
        .nx = static_cast<shaders::uint>(lattice_.x_mm.count),
        .ny = static_cast<shaders::uint>(lattice_.y_mm.count),
        .segments = static_cast<shaders::uint>(runs.size()),
        .elements = static_cast<shaders::uint>(known.from_pivot_mm.size()),
        .map_width = object.width,
        .map_height = object.height};
    const auto plane = static_cast<std::uint32_t>(lattice_.plane());
    stream_.dispatch(kernel_, {&object.map, &object.axes, &elements, &segments, &object.belief},
                     push,
                     {(plane + workgroup - 1) / workgroup, 1,
                      static_cast<std::uint32_t>(lattice_.theta_rad.count)});
  }
  stream_.run();
}

std::vector<double> OneBinKernel::log_likelihood(std::size_t object) {
  std::vector<TwoFloat> bins(static_cast<std::size_t>(lattice_.bins()));
  stream_.download(objects_[object].belief, std::span(bins));
  stream_.run();
  std::vector<double> values;
  values.reserve(bins.size());
  for (const TwoFloat& bin : bins) {
    values.push_back(bin.value());
  }
  return values;
}

}  // namespace palpate::bench
