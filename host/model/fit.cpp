#include "palpate/fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "model/displacement_points.hpp"
#include "model/map_likelihood.hpp"
#include "model/random.hpp"
#include "model/reading_mixture.hpp"
#include "model/refuse.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

namespace {

/// Adds an element's reading, which has probability q(r) = P(r) / sum over all r' of P(r').
/// @param log_p [level] log P of each reading, in nats
void add(FitSums& sums, Reading reading, std::span<const double> log_p) {
  const double largest = *std::ranges::max_element(log_p);
  std::array<double, most_reading_levels> probability{};
  double total = 0.0;
  for (std::size_t level = 0; level < log_p.size(); ++level) {
    total += probability[level] = std::exp(log_p[level] - largest);
  }
  double below_largest = 0.0;  // of the mean: no cancellation
  for (std::size_t level = 0; level < log_p.size(); ++level) {
    probability[level] /= total;
    below_largest += probability[level] * (log_p[level] - largest);
  }
  const double mean = largest + below_largest;
  sums.deviation += log_p[static_cast<std::size_t>(reading)] - mean;
  for (std::size_t level = 0; level < log_p.size(); ++level) {
    const double from_mean = log_p[level] - mean;
    sums.variance += probability[level] * from_mean * from_mean;
  }
}

Verdict verdict_on(double z, double fits_from = fits_from_z,
                   double doubtful_from = doubtful_from_z) {
  return z >= fits_from       ? Verdict::fits
         : z >= doubtful_from ? Verdict::doubtful
                              : Verdict::does_not_fit;
}

/// What the object says about these elements where each of the displacements may be the sensor's.
ReadingMixture mixture_of(std::span<const glm::dvec2> elements_mm, const Pose& T_object_sensor,
                          std::span<const Pose> displacements, const MapLikelihood& likelihood) {
  ReadingMixture mixture(displacements.size(), elements_mm.size(), likelihood.levels());
  std::vector<double> logs(elements_mm.size() * likelihood.levels());
  for (std::size_t k = 0; k < displacements.size(); ++k) {
    likelihood.all_readings(elements_mm, T_object_sensor * displacements[k], logs);
    mixture.set(k, logs);
  }
  return mixture;
}

}  // namespace

Fit FitScale::of(const Fit& fit, std::size_t touches) const {
  if (mean == 0.0 && sd == 1.0 && shared_sd == 0.0 && !single_touch) {
    return fit;
  }
  const auto n = static_cast<double>(touches);
  const double gained = single_touch ? (single_touch->mean - mean) / std::sqrt(n) : 0.0;
  const double spread = single_touch && touches == 1
                            ? single_touch->sd
                            : std::sqrt(sd * sd + n * shared_sd * shared_sd);
  const double z =
      std::clamp((fit.z - mean * std::sqrt(n) - gained) / spread, -largest_fit_z, largest_fit_z);
  return {.z = z, .verdict = verdict_on(z, scaled_fits_from_z, scaled_doubtful_from_z)};
}

FitScale FitScale::for_array(const FitArray& other) const {
  FitScale scale = *this;
  if (!array) {
    return scale;
  }
  const double more = std::sqrt(other.elements / array->elements);
  const double denser =
      other.spacing_mm > 0.0 ? std::max(1.0, array->spacing_mm / other.spacing_mm) : 1.0;
  scale.mean *= more;
  scale.shared_sd *= more;
  scale.sd *= denser;
  if (scale.single_touch) {
    scale.single_touch->mean *= more;
    scale.single_touch->sd *= denser;
  }
  scale.array = other;
  return scale;
}

FitScale pooled(std::span<const FitScale> objects) {
  constexpr double least_sd = 0.25;
  constexpr double least_shared_sd = 0.03;
  const auto k = static_cast<double>(objects.size());
  double mean = 0.0;
  double within = 0.0;
  for (const FitScale& object : objects) {
    mean += object.mean / k;
    within += object.sd * object.sd / k;
  }
  double between = 0.0;
  for (const FitScale& object : objects) {
    between += (object.mean - mean) * (object.mean - mean) / k;
  }
  const double of_objects = objects.size() > 1 ? between * k / (k - 1.0) : 0.0;
  const double shared = std::max(0.5 * std::sqrt(of_objects), least_shared_sd);
  // All touches, one of each at a time, vary by `within + between`.
  const double own = within + between - shared * shared;
  return {.mean = mean, .sd = std::sqrt(std::max(own, least_sd * least_sd)), .shared_sd = shared};
}

std::optional<Fit> fit_of(std::span<const Touch> touches, const Pose& T_object_robot,
                          const OccupancyGrid& map, const ContactModel& contact,
                          const DisplacementSd& touch_sd, std::size_t object) {
  contact.validate();
  require_sound_map(map);
  require_finite(T_object_robot);
  for (const double sd : {touch_sd.mm, touch_sd.rad}) {
    require(sd >= 0.0 && std::isfinite(sd), "touch_sd", sd, "give finite numbers from 0");
  }
  return evidence_fit(evidence_of(touches, contact), T_object_robot, map, contact, touch_sd,
                      object);
}

std::optional<Fit> evidence_fit(std::span<const TouchEvidence> touches, const Pose& T_object_robot,
                                const OccupancyGrid& map, const ContactModel& contact,
                                const DisplacementSd& touch_sd, std::size_t object) {
  return combined_fit(fit_sums(touches, T_object_robot, map, contact, touch_sd, object));
}

std::optional<Fit> combined_fit(std::span<const std::optional<FitSums>> sums) {
  FitSums all;
  bool any_known = false;
  for (const std::optional<FitSums>& touch : sums) {
    if (touch) {
      all.deviation += touch->deviation;
      all.variance += touch->variance;
      any_known = true;
    }
  }
  if (!any_known) {
    return {};
  }
  // Where nothing else is possible, readings may be as predicted with a variance of 0.
  const double z = all.deviation == 0.0 ? 0.0
                                        : std::clamp(all.deviation / std::sqrt(all.variance),
                                                     -largest_fit_z, largest_fit_z);
  return Fit{.z = z, .verdict = verdict_on(z)};
}

std::vector<std::optional<FitSums>> fit_sums(std::span<const TouchEvidence> touches,
                                             const Pose& T_object_robot, const OccupancyGrid& map,
                                             const ContactModel& contact,
                                             const DisplacementSd& touch_sd, std::size_t object) {
  constexpr std::size_t points = 128;  // log means of letters within 0.1 nats, sd 1 mm and 0.05 rad
  constexpr std::size_t draws = 64;    // the mean of z is out by 1 / sqrt(draws) at most
  const MapLikelihood likelihood(map, contact, object);
  const std::vector<Pose> displacements = displacement_points(touch_sd, points);
  const auto displaced = [&](const TouchEvidence& known, const Pose& T_object_sensor) {
    // By its readings alone (FNV-1a): no other touch and no rounding of poses changes its draws.
    std::uint64_t seed = 0xcbf29ce484222325;
    for (const Reading reading : known.readings) {
      seed = (seed ^ static_cast<std::uint64_t>(reading)) * 0x100000001b3;
    }
    Random random(seed, Stream::readings);
    std::vector<Pose> drawn(draws);
    for (Pose& displacement : drawn) {
      displacement = random_displacement(touch_sd, random);
    }
    const ReadingMixture judge =
        mixture_of(known.elements_mm, T_object_sensor, displacements, likelihood);
    const ReadingMixture source = mixture_of(known.elements_mm, T_object_sensor, drawn, likelihood);
    const Moments predicted = predicted_log_mean(judge, source, random);
    return FitSums{judge.log_mean(known.readings) - predicted.mean, predicted.variance};
  };
  const auto undisplaced = [&](const TouchEvidence& known, const Pose& T_object_sensor) {
    const std::size_t levels = likelihood.levels();
    std::vector<double> logs(known.readings.size() * levels);
    likelihood.all_readings(known.elements_mm, T_object_sensor, logs);
    FitSums sums;
    for (std::size_t e = 0; e < known.readings.size(); ++e) {
      add(sums, known.readings[e], std::span(logs).subspan(e * levels, levels));
    }
    return sums;
  };
  std::vector<std::optional<FitSums>> sums;
  for (const TouchEvidence& touch : touches) {
    const TouchEvidence known = touch.known();
    const Pose T_object_sensor = T_object_robot * touch.T_robot_sensor;
    sums.push_back(known.readings.empty() ? std::optional<FitSums>()
                   : touch_sd.none()      ? undisplaced(known, T_object_sensor)
                                          : displaced(known, T_object_sensor));
  }
  return sums;
}

}  // namespace palpate
