#pragma once

#include <functional>
#include <span>
#include <vector>

#include "belief.hpp"
#include "command_stream.hpp"
#include "contact_evidence.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/sensor_model.hpp"

namespace palpate {

/// The log-likelihood of touches at every bin of the lattice, for several maps (Eq. 7): one bin per
/// kernel invocation.
class DenseLikelihood {
 public:
  /// Records the upload of the maps, in the order of the belief's objects. Beyond each of them lies
  /// the model's prior.
  DenseLikelihood(gpu::Context& context, gpu::CommandStream& stream,
                  std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
                  const ContactLikelihood& model);

  /// Most elements that one segment of the evidence may hold.
  std::size_t segment_elements() const { return segment_elements_; }

  /// Adds the evidence to the belief. Runs the stream from time to time, so that no submission
  /// keeps a device busy for long, and reports the fraction done.
  void accumulate(const ContactEvidence& evidence, const Belief& belief,
                  const std::function<void(double)>& progress);

  std::uint64_t device_bytes() const;

 private:
  struct Map {
    int width = 0;   ///< with border
    int height = 0;  ///< with border
    gpu::Buffer log_odds;
    gpu::Buffer axes;  ///< the lattice's x and y in cells of this map
  };
  /// Maps of one cell size share the rotated elements.
  struct Scale {
    double cell_mm = 0.0;
    std::vector<std::size_t> objects;
  };

  /// Makes room for this many elements in the tables.
  void reserve(std::size_t elements);

  gpu::Context& context_;
  gpu::CommandStream& stream_;
  PoseLattice lattice_;
  gpu::Kernel kernel_;
  std::vector<Map> maps_;
  std::vector<Scale> scales_;
  VkDeviceSize bytes_per_element_ = 0;  ///< rotated by every theta
  std::size_t batch_elements_ = 0;      ///< most elements in the tables
  std::size_t segment_elements_ = 0;
  gpu::Buffer elements_;
  gpu::Buffer segments_;
};

}  // namespace palpate
