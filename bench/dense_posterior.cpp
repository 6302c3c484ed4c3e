#include "dense_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "palpate/error.hpp"
#include "reference/reference.hpp"

namespace palpate::bench {

namespace {

/// Mass, relative to the object's best bin, that bins may hold together and keep float32 values.
/// Those err by some 4e-6 nats, which leaves 4e-12 of the object's evidence.
constexpr double negligible = 1e-6;

double log_sum_exp(std::span<const double> logs) {
  const double most = *std::ranges::max_element(logs);
  double sum = 0.0;
  for (const double log : logs) {
    sum += std::exp(log - most);
  }
  return most + std::log(sum);
}

std::vector<double> over_their_sum(std::span<const double> logs) {
  const double log_total = log_sum_exp(logs);
  std::vector<double> probabilities;
  for (const double log : logs) {
    probabilities.push_back(std::exp(log - log_total));
  }
  return probabilities;
}

/// The known elements of some touches, classified once.
class KnownTouches {
 public:
  KnownTouches(std::span<const Touch> touches, const ContactModel& contact) : contact_(contact) {
    for (const Touch& touch : touches) {
      const std::vector<Reading> readings = contact.classify(touch);
      for (std::size_t e = 0; e < readings.size(); ++e) {
        if (readings[e] != Reading::unknown) {
          elements_.push_back({touch.T_robot_sensor * touch.elements_mm[e], readings[e]});
        }
      }
    }
  }

  double log_likelihood(std::size_t object, const OccupancyGrid& map,
                        const Pose& T_object_robot) const {
    double sum = 0.0;
    for (const ElementReading& element : elements_) {
      const MapSample sample{
          reference::interpolate(map, *contact_.prior, T_object_robot * element.position_mm)};
      sum += reference::log_likelihood(element.reading, sample, contact_, object);
    }
    return sum;
  }

 private:
  ContactModel contact_;
  std::vector<ElementReading> elements_;
};

/// Nats below `best` at which the bins further below hold a negligible mass together.
double negligible_depth(std::span<const double> logs, double best) {
  constexpr double step = 2.0;
  std::vector<double> mass_at(400, 0.0);  // [depth / step]; 800 nats are below the least double
  for (const double log : logs) {
    const double depth = std::max(best - log, 0.0);
    mass_at[static_cast<std::size_t>(
        std::min(depth / step, static_cast<double>(mass_at.size() - 1)))] += std::exp(-depth);
  }
  double below = 0.0;
  std::size_t i = mass_at.size();
  while (i > 0 && below + mass_at[i - 1] <= negligible) {
    below += mass_at[--i];
  }
  return step * static_cast<double>(i);
}

/// An object's marginals, of masses relative to exp(best).
Marginals summed(std::span<const double> logs, const PoseLattice& lattice, double best) {
  Marginals sums{.grid = lattice,
                 .xy = std::vector<double>(static_cast<std::size_t>(lattice.plane())),
                 .theta = std::vector<double>(static_cast<std::size_t>(lattice.theta_rad.count))};
  for (std::size_t bin = 0; bin < logs.size(); ++bin) {
    const double mass = std::exp(logs[bin] - best);
    sums.xy[bin % sums.xy.size()] += mass;
    sums.theta[bin / sums.xy.size()] += mass;
  }
  return sums;
}

/// Half the summed distance of two lists of probabilities of one object's parts.
double half_distance(std::span<const double> a, std::span<const double> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += std::abs(a[i] - b[i]);
  }
  return sum / 2.0;
}

bool within(double value, double low, double high) {
  return low - summing_error <= value && value <= high + summing_error;
}

}  // namespace

DensePosterior dense_posterior(const PoseHistogram& histogram,
                               std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                               std::span<const Touch> touches) {
  ContactModel with_prior = contact;
  with_prior.prior = contact.prior.value_or(hypotheses.front().map.prior);
  const KnownTouches known(touches, with_prior);
  const PoseLattice& lattice = histogram.lattice();
  const double best = histogram.estimate().mode.log_likelihood;
  double weights = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    weights += hypothesis.weight;
  }
  DensePosterior dense;
  double best_weighted = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const double log_weight = std::log(hypotheses[i].weight / weights);
    std::vector<double> logs = histogram.log_likelihood(static_cast<int>(i));
    const double own_best = *std::ranges::max_element(logs);
    const double depth = negligible_depth(logs, own_best);
    for (std::size_t bin = 0; bin < logs.size(); ++bin) {
      if (own_best - logs[bin] <= depth) {
        logs[bin] = known.log_likelihood(
            i, hypotheses[i].map, reference::bin_pose(lattice, static_cast<std::int64_t>(bin)));
      }
    }
    const auto largest = std::ranges::max_element(logs);
    if (log_weight + *largest > best_weighted) {
      best_weighted = log_weight + *largest;
      dense.mode = {.object = static_cast<int>(i),
                    .bin = largest - logs.begin(),
                    .T_object_robot = lattice.T_object_robot(largest - logs.begin()),
                    .log_likelihood = *largest};
    }
    dense.log_evidence.push_back(log_weight + log_sum_exp(logs));
    dense.marginals.push_back(summed(logs, lattice, best));
    for (std::vector<double>* sums : {&dense.marginals.back().xy, &dense.marginals.back().theta}) {
      for (double& mass : *sums) {
        mass *= std::exp(log_weight);
      }
    }
  }
  dense.identity = over_their_sum(dense.log_evidence);
  const double total = std::exp(log_sum_exp(dense.log_evidence) - best);
  for (Marginals& marginals : dense.marginals) {
    for (std::vector<double>* sums : {&marginals.xy, &marginals.theta}) {
      for (double& mass : *sums) {
        mass /= total;
      }
    }
  }
  return dense;
}

double CertificateCheck::measured() const {
  return std::max({mass_outside, total_variation, identity_error});
}

bool CertificateCheck::holds() const {
  return bounds_hold && measured() <= promised + summing_error;
}

CertificateCheck check_certificate(const BoundedPosterior& bounded, const DensePosterior& dense) {
  const Estimate estimate = bounded.estimate();
  if (!estimate.certificate) {
    throw Error(Fault::system, "bounded posterior: its estimate has no certificate");
  }
  const Certificate& certificate = *estimate.certificate;
  CertificateCheck check{
      .promised = certificate.dropped_mass,
      .same_mode = estimate.mode.object == dense.mode.object && estimate.mode.bin == dense.mode.bin,
      .bounds_hold = true};
  // Two bins of one likelihood up to rounding are both modes.
  check.same_mode = check.same_mode || std::abs(estimate.mode.log_likelihood -
                                                dense.mode.log_likelihood) <= summing_error;
  std::vector<double> counted;
  double xy = 0.0;
  double theta = 0.0;
  for (std::size_t i = 0; i < dense.identity.size(); ++i) {
    const LogInterval& evidence = certificate.log_evidence[i];
    const ProbabilityInterval& bounds = estimate.identity_bounds[i];
    counted.push_back(evidence.low);
    check.bounds_hold = check.bounds_hold &&
                        within(dense.log_evidence[i], evidence.low, evidence.high) &&
                        within(dense.identity[i], bounds.low, bounds.high);
    check.identity_error =
        std::max(check.identity_error, std::abs(estimate.identity[i] - dense.identity[i]));
    const Marginals marginals = bounded.marginals(static_cast<int>(i));
    xy += half_distance(marginals.xy, dense.marginals[i].xy);
    theta += half_distance(marginals.theta, dense.marginals[i].theta);
  }
  check.total_variation = std::max(xy, theta);
  check.mass_outside =
      std::max(0.0, -std::expm1(log_sum_exp(counted) - log_sum_exp(dense.log_evidence)));
  return check;
}

}  // namespace palpate::bench
