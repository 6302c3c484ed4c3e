#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "known_elements.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// Neighbouring bins of one object and theta.
struct BinBox {
  std::int32_t object = 0;
  std::int32_t theta = 0;
  std::int32_t y_first = 0;
  std::int32_t y_count = 0;
  std::int32_t x_first = 0;
  std::int32_t x_count = 0;

  std::int64_t bins() const { return std::int64_t{y_count} * x_count; }
};

/// Evaluates the log-likelihood (Eq. 7, 13) of bins on the host, by vector instructions chosen at
/// run time. The same bits on every processor. Calls from several threads may run at once.
class BinLikelihood {
 public:
  /// @param contact resolved: with its prior
  BinLikelihood(std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                const PoseLattice& lattice);
  void move_pivot(const glm::dvec2& pivot_mm);

  /// Log-likelihood of the elements at every bin in nats, boxes one after another, [y, x] in each.
  /// In float32 arithmetic, and in float64.
  void evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                std::span<float> log_likelihood) const;
  void evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                std::span<double> log_likelihood) const;

  /// Proven bound, in nats, of the error of evaluate() at any bin of an object.
  double float32_error(std::size_t object, const KnownElements& elements) const;
  double float64_error(std::size_t object, const KnownElements& elements) const;

 private:
  std::vector<Hypothesis> hypotheses_;
  ContactModel contact_;
  PoseLattice lattice_;
};

}  // namespace palpate
