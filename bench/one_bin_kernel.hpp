#pragma once

#include <span>
#include <vector>

#include "gpu/command_stream.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::bench {

/// The likelihood by the straightforward kernel: one bin per invocation, storage buffers only. For
/// lattices that fit one binding and one dispatch.
class OneBinKernel {
 public:
  OneBinKernel(Device& device, std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
               const ContactModel& model);

  /// Adds the touches' log-likelihood to all bins.
  void update(std::span<const Touch> touches);
  /// The log-likelihood of every bin of one object in nats, [theta, y, x].
  std::vector<double> log_likelihood(std::size_t object);

 private:
  struct Object {
    int width = 0;
    int height = 0;
    gpu::Buffer map;
    gpu::Buffer axes;
    gpu::Buffer belief;
  };

  gpu::Context& context_;
  gpu::CommandStream stream_;
  gpu::Kernel kernel_;
  PoseLattice lattice_;
  double cell_mm_;  ///< of all maps
  std::vector<Object> objects_;
};

}  // namespace palpate::bench
