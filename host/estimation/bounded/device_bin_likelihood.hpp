#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "estimation/bounded/bin_likelihood.hpp"
#include "estimation/bounded/known_elements.hpp"
#include "estimation/contact_kernel.hpp"
#include "estimation/lattice/map_table.hpp"
#include "gpu/command_stream.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"
#include "shaders/interface.h"

namespace palpate {

/// Evaluates the log-likelihood (Eq. 7, 13) of bins on the device. Bits depend on the device, but
/// on one device a bin has the same bits in every box. Like the device not thread-safe.
class DeviceBinLikelihood {
 public:
  /// Uploads the maps, and runs every kernel once: drivers compile them then.
  /// @param contact resolved: with its prior
  /// @throws Error where the device has not the memory, or cannot read a map, axis or table
  DeviceBinLikelihood(gpu::Context& context, std::span<const Hypothesis> hypotheses,
                      const ContactModel& contact, const PoseLattice& lattice);
  void move_pivot(const glm::dvec2& pivot_mm);

  /// Log-likelihood of the elements at every bin in nats, boxes one after another, [y, x] in each.
  /// DeviceBinError bounds their errors.
  /// @throws Error where the device has not the memory for tables and results
  void evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                std::span<float> log_likelihood);

  const std::string& device() const { return context_.name(); }
  std::uint64_t device_bytes() const;

 private:
  /// Objects whose maps a dispatch reads together.
  struct Group : MapGroup {
    MapTable maps;
    std::vector<shaders::BoxPlace> places;  ///< [object of the group], where their data begin
  };
  /// Rows of a box that fit a dispatch, and where their bins stand among the results.
  struct Piece {
    BinBox box;
    std::size_t first_bin = 0;
  };
  /// Elements that a dispatch takes: [begin, end) and their readings, from `begin` on.
  struct Portion {
    std::size_t begin = 0;
    std::size_t end = 0;
    std::vector<shaders::Segment> segments;
  };
  /// Pieces of one group that a dispatch takes, and the elements' places at their thetas.
  struct Batch {
    std::vector<shaders::BoxPlace> places;
    std::vector<shaders::RotatedElement> rotated;
    std::uint32_t runs = 0;
    std::uint32_t bins = 0;
  };

  Group make_group(const MapGroup& group, std::span<const Hypothesis> hypotheses, double prior);
  gpu::Kernel make_kernel(gpu::Access maps, const ContactModel& contact);
  /// Cuts the boxes of a group's objects into pieces of at most this many bins.
  std::vector<Piece> pieces_of(const Group& group, std::span<const BinBox> boxes,
                               std::size_t most_bins) const;
  std::vector<Portion> portions_of(const KnownElements& elements) const;
  /// Bins of a dispatch with this many elements, so that it ends soon.
  std::size_t most_bins_for(std::size_t elements) const;
  /// Takes pieces from the front until a batch is full.
  Batch fill(const Group& group, std::span<const Piece>& pieces, const Portion& portion,
             const KnownElements& elements) const;
  /// Runs the kernel; results_ then hold the batch's bins.
  void dispatch(const Group& group, const Batch& batch, const Portion& portion);

  gpu::Context& context_;
  gpu::CommandStream stream_;
  PoseLattice lattice_;
  ContactTable contact_table_;
  std::vector<std::size_t> group_of_;  ///< [object]
  std::vector<std::size_t> place_of_;  ///< [object], in its group
  std::vector<Group> groups_;
  gpu::Kernel kernels_[2];    ///< for maps in storage buffers and in tables
  std::size_t most_bins_;     ///< of a dispatch
  std::size_t most_rotated_;  ///< elements times thetas of a dispatch
  gpu::Buffer results_;
  gpu::Buffer rotated_;
  gpu::Buffer boxes_;
  gpu::Buffer segments_;
};

}  // namespace palpate
