#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimation/bounded/bin_likelihood.hpp"
#include "estimation/bounded/device_bin_error.hpp"
#include "estimation/bounded/device_bin_likelihood.hpp"
#include "estimation/bounded/known_elements.hpp"
#include "gpu/context.hpp"

namespace palpate {

/// Where bins are evaluated.
enum class BinPlace {
  measured,  ///< where it was faster when both evaluated a batch, once the host has done enough
  host,
  device,
};

/// Evaluates batches of bins in float32 on the host's threads or on the device, wherever it is
/// faster. The device takes its maps when it is first used. Not thread-safe; uses the threads of
/// the TBB arena that calls it.
class FasterBinLikelihood {
 public:
  /// Products of bins and elements that the host evaluates before both are measured: some 0.3 s on
  /// two cores, as long as a device may take to compile its kernel and to take its maps.
  static constexpr double least_measured_work = 1e9;

  /// @param host,hypotheses outlive this object
  /// @param context of the device; null for BinPlace::host
  /// @param contact resolved: with its prior
  FasterBinLikelihood(const BinLikelihood& host, gpu::Context* context,
                      std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                      const PoseLattice& lattice, BinPlace place = BinPlace::measured,
                      double measured_work = least_measured_work);
  /// For the device; the host's is moved by its owner.
  void move_pivot(const glm::dvec2& pivot_mm);

  /// Log-likelihood of the elements at every bin in nats, boxes one after another, [y, x] in each.
  /// @param may_measure whether there is time to start the device and to evaluate a batch twice
  /// @throws Error where BinPlace::device was asked for and the device fails
  void evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                std::span<float> log_likelihood, bool may_measure = true);

  /// Bound, in nats, of the error of evaluate() at any bin of an object, wherever it is evaluated.
  double float32_error(std::size_t object, const KnownElements& elements) const;

  /// Where bins are evaluated, and why: "bins on the host: 0.4 ns, device 0.9 ns per element and
  /// bin".
  const std::string& path() const { return path_; }

 private:
  void evaluate_on_host(std::span<const BinBox> boxes, const KnownElements& elements,
                        std::span<float> log_likelihood) const;
  DeviceBinLikelihood& device();
  /// Evaluates the batch in both places and decides from then on.
  void measure(std::span<const BinBox> boxes, const KnownElements& elements,
               std::span<float> log_likelihood, double work);

  const BinLikelihood& host_;
  gpu::Context* context_;
  std::span<const Hypothesis> hypotheses_;
  ContactModel contact_;
  PoseLattice lattice_;
  BinPlace place_;
  double measured_work_;
  double host_work_ = 0.0;          ///< done so far: products of bins and elements
  double least_device_work_ = 0.0;  ///< of a batch that the device takes
  DeviceBinError device_error_;
  std::unique_ptr<DeviceBinLikelihood> device_;
  std::string path_;
};

}  // namespace palpate
