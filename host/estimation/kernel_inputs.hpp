#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "gpu/command_stream.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"
#include "shaders/interface.h"

namespace palpate {

/// The map's log odds as kernels read them, with shaders::MAP_BORDER rows and columns of the prior
/// on every side, so that a clamped index finds the prior.
std::vector<float> with_border(const OccupancyGrid& map, double prior);

/// Cells of the map with its border.
std::uint64_t bordered_cells(const OccupancyGrid& map);

/// Most cells that one buffer of the device holds.
std::uint64_t most_map_cells(const gpu::Limits& limits, gpu::Access access);
/// Most cells that one buffer holds in whichever way the device reads more.
std::uint64_t most_map_cells(const gpu::Limits& limits);

/// The fastest way in which kernels can read this many cells; nothing where no buffer holds them.
std::optional<gpu::Access> map_access(const gpu::Limits& limits, std::uint64_t cells);

/// Maps on the device, one after the other in a buffer: in storage the nodes of with_border(), in a
/// table each of these with the three above and to its right.
class BorderedMaps {
 public:
  BorderedMaps(gpu::Context& context, gpu::Access access, std::uint64_t cells,
               std::string_view purpose);

  /// Records the upload of the next map. Beyond it lies the prior.
  /// @returns the index of its first node
  int add(gpu::CommandStream& stream, const OccupancyGrid& map, double prior);

  const gpu::Buffer& nodes() const { return nodes_; }

 private:
  gpu::Buffer nodes_;
  std::uint64_t added_ = 0;  ///< cells
};

/// Splits an element's coordinate into whole cells and the rest. One beyond 2^29 cells, or that is
/// no number, counts as off every map: its cell becomes so large that the sum with any cell of
/// split_axis() is outside, yet within int32.
shaders::Split split(double coordinate_cells);
/// Splits the coordinate of a place of the lattice, to which an element's is added.
shaders::Split split_axis(double coordinate_cells);

/// Every element rotated by every theta of the lattice, in cells, [theta, element].
/// @param reuse memory for the result
std::vector<shaders::RotatedElement> rotated_elements(
    std::span<const glm::dvec2> from_pivot_mm, const Axis& theta_rad, double cell_mm,
    std::vector<shaders::RotatedElement> reuse = {});

/// The lattice's x, then its y, in cells of the map with its border, [nx + ny].
std::vector<shaders::Split> axes_in_cells(const OccupancyGrid& map, const PoseLattice& lattice);

/// The specialization constants 0 to 6 of the kernels that evaluate the contact model: the
/// lanes of a workgroup, then those of shaders/segment_sum.glsl. The model's prior must be
/// set.
std::vector<std::uint32_t> contact_constants(const gpu::Limits& limits, const ContactModel& model);

/// The objects' numbers of the model's table on the device, shaders::TableNode. A model without a
/// table has one node that no kernel reads, because kernels bind the buffer all the same.
class ContactTable {
 public:
  /// Records the upload.
  /// @throws Error where the table has more nodes than the device reads
  ContactTable(gpu::Context& context, gpu::CommandStream& stream, const ContactModel& model);

  const gpu::Buffer& nodes() const { return nodes_; }
  /// Index of the first node of an object's numbers.
  int first_node(std::size_t object) const { return static_cast<int>(object * nodes_of_a_set_); }

 private:
  std::size_t nodes_of_a_set_ = 0;  ///< 0 where all objects share the numbers
  gpu::Buffer nodes_;
};

}  // namespace palpate
