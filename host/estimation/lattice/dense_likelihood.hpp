#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "estimation/kernel_inputs.hpp"
#include "estimation/known_elements.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "gpu/command_stream.hpp"
#include "gpu/kernel.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// A way to evaluate the likelihood over the lattice, for maps of one cell size: the
/// kernel accumulate_likelihood, of which an invocation takes bins_x x bins_y bins of one theta.
struct LikelihoodPath {
  gpu::Kernel kernel;
  std::uint32_t bins_x = 1;
  std::uint32_t bins_y = 1;
  std::string description;  ///< what it does and why it was chosen
};

/// Objects whose maps are of one cell size, read by kernels in one way, and, like their axes,
/// together no larger than what a kernel reads at once.
struct MapGroup {
  double cell_mm = 0.0;
  /// Tables are the fast way, which not every device has for large maps.
  gpu::Access access = gpu::Access::table;
  std::uint64_t cells = 0;           ///< that the maps take in a buffer
  std::vector<std::size_t> objects;  ///< ascending

  bool alike(const MapGroup& other) const {
    return cell_mm == other.cell_mm && access == other.access;
  }
};

/// The log-likelihood of touches at every bin of the lattice, for several maps (Eq. 7).
class DenseLikelihood {
 public:
  /// Elements that a dispatch takes at best: a multiple of the factors of a product, unless the
  /// device's tables hold fewer.
  /// @throws Error where they do not hold one element at every theta
  static std::size_t batch_for(const gpu::Context& context, const PoseLattice& lattice,
                               std::size_t objects);
  /// Records the upload of the maps, in the order of the belief's objects, and a first, empty run
  /// of every kernel: drivers compile them then, and no touch has to wait for that. Beyond each map
  /// lies the model's prior. @throws Error where a map is larger than what kernels read
  DenseLikelihood(gpu::Context& context, gpu::CommandStream& stream, const DenseBelief& belief,
                  std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
                  const ContactModel& model);

  /// Most elements that one run may hold.
  std::size_t longest_run() const { return batch_elements_; }

  /// Adds the elements' log-likelihoods to the belief. Runs the stream from time to time, so that
  /// no submission keeps a device busy for long, and reports the fraction done.
  void accumulate(const KnownElements& elements, const DenseBelief& belief,
                  const std::function<void(double)>& progress);

  /// The path of every cell size among the maps, and why it was chosen.
  std::vector<std::string> paths() const;

  std::uint64_t device_bytes() const;

 private:
  /// Objects that a dispatch takes together.
  struct Group : MapGroup {
    LikelihoodPath path;
    BorderedMaps maps;
    gpu::Buffer axes;    ///< the lattice's x centres, then its y, in cells of each map, [object]
    gpu::Buffer places;  ///< shaders::ObjectPlace, [object]
  };
  /// The objects of a group that a slab holds: a range of group.objects.
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };

  static Range within(const Group& group, const Slab& slab);
  /// Records one run of the group's kernel over its objects in a slab.
  void dispatch(const Group& group, const Range& range, const Slab& slab, std::size_t segments,
                std::size_t elements);
  /// Makes room for this many elements in the tables.
  void reserve(std::size_t elements);

  gpu::Context& context_;
  gpu::CommandStream& stream_;
  PoseLattice lattice_;
  std::size_t objects_;
  ContactTable contact_;
  std::vector<Group> groups_;
  std::size_t batch_elements_ = 0;  ///< most elements in the tables
  gpu::Buffer elements_;
  gpu::Buffer segments_;
  std::vector<shaders::Segment> batch_;           ///< what goes to segments_
  std::vector<shaders::RotatedElement> rotated_;  ///< what goes to elements_
};

}  // namespace palpate
