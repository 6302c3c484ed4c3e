#include "bin_likelihood.hpp"

#include "interpolated_map.hpp"

namespace palpate {

BinLikelihood::BinLikelihood(std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                             const PoseLattice& lattice)
    : hypotheses_(hypotheses.begin(), hypotheses.end()), contact_(contact), lattice_(lattice) {}

void BinLikelihood::move_pivot(const glm::dvec2& pivot_mm) { lattice_.pivot_mm = pivot_mm; }

void BinLikelihood::evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                             std::span<double> log_likelihood) const {
  std::size_t bin = 0;
  for (const BinBox& box : boxes) {
    const InterpolatedMap map(hypotheses_[box.object].map, *contact_.prior);
    const double theta_rad = lattice_.theta_rad.centre(box.theta);
    for (int j = 0; j < box.y_count; ++j) {
      for (int i = 0; i < box.x_count; ++i, ++bin) {
        const glm::dvec2 at(lattice_.x_mm.centre(box.x_first + i),
                            lattice_.y_mm.centre(box.y_first + j));
        double sum = 0.0;
        for (const ReadingRun& run : elements.runs) {
          for (std::size_t e = run.begin; e < run.end; ++e) {
            const glm::dvec2 p_mm = rotate(theta_rad, elements.from_pivot_mm[e]) + at;
            sum += contact_.log_likelihood(run.reading, {map.log_odds(p_mm)}, box.object);
          }
        }
        log_likelihood[bin] = sum;
      }
    }
  }
}

void BinLikelihood::evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                             std::span<float> log_likelihood) const {
  std::vector<double> exact(log_likelihood.size());
  evaluate(boxes, elements, std::span(exact));
  for (std::size_t i = 0; i < exact.size(); ++i) {
    log_likelihood[i] = static_cast<float>(exact[i]);
  }
}

double BinLikelihood::float32_error(std::size_t /*object*/, const KnownElements& elements) const {
  return 1e-5 * static_cast<double>(elements.from_pivot_mm.size());
}

double BinLikelihood::float64_error(std::size_t /*object*/, const KnownElements& elements) const {
  return 1e-13 * static_cast<double>(elements.from_pivot_mm.size());
}

}  // namespace palpate
