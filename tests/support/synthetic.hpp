#pragma once

#include <cstdint>
#include <iterator>
#include <numbers>
#include <span>
#include <vector>

#include "palpate/map_builder.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/touch.hpp"
#include "reference/reference.hpp"

namespace palpate {

inline constexpr double two_pi = 2.0 * std::numbers::pi;

/// What the method allows a log-likelihood to differ from float64, in nats per touch.
inline constexpr double per_touch = 1e-4;

/// Numbers spread evenly over [lower, upper), the same on every standard library.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : state_(seed) {}
  double operator()(double lower, double upper);

 private:
  std::uint64_t state_;
};

/// One of several choices, each as likely.
template <typename Choices>
auto one_of(Uniform& random, const Choices& choices) {
  return choices[static_cast<std::size_t>(random(0.0, static_cast<double>(std::size(choices))))];
}

/// Touches of no object in particular: elements over [-6, 6]^2 mm, poses over [-8, 8]^2 mm and all
/// angles, and as many In Contact as No Contact and Unknown elements; the first is In Contact.
Recording random_recording(std::size_t touches, std::size_t elements, std::uint64_t seed);

/// A grid about the origin whose cells have independent log odds in [-steepness, steepness]: any
/// error of position shows.
OccupancyGrid random_map(int nx, int ny, double cell_mm, double steepness, std::uint64_t seed);

/// Two such objects of different sizes, 0.5 mm a cell.
std::vector<Hypothesis> two_objects(double steepness, std::uint64_t seed);

/// Every touch of a recording.
std::vector<Touch> all_touches(const Recording& recording);

/// A recording's touches as a robot frame moved by T_moved_robot has them.
Recording moved(Recording recording, const Pose& T_moved_robot);

double sum(std::span<const double> values);
/// Largest absolute difference, element by element; infinite where the sizes differ.
double largest_difference(std::span<const double> a, std::span<const double> b);

/// log of the sum of exp(l), of one number at least.
double log_sum(std::span<const double> logs);

/// Log-likelihoods of all objects after the touches, [object][bin], from the reference.
reference::Posterior reference_posterior(std::span<const Hypothesis> hypotheses,
                                         const HistogramOptions& options,
                                         std::span<const Touch> touches);

/// Largest difference in nats between the product's and the reference's bins of any object.
double likelihood_error(const PoseHistogram& histogram, const reference::Posterior& expected);

/// Largest difference in nats between a map and the reference, also over the cells around it, which
/// hold the prior.
double map_error(const OccupancyGrid& map, std::span<const Touch> touches,
                 const MapOptions& options);

}  // namespace palpate
