#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

namespace palpate {

/// Purpose of random numbers. Each purpose has a stream of its own for the same seed; else the
/// first random touch of an unknown would repeat the numbers of its pose.
enum class Stream : std::uint32_t {
  sensor,
  touch_poses,
  object_pose,
  touch_order,
  frames,
  pose_noise,
  belief,       // draws from it
  readings,     // of touches that are only imagined
  slips,        // of objects between touches
  touch_means,  // bins over which a touch's mean likelihood is
  unknowns,     // poses at which a calibration puts objects
};

/// Draws random numbers that are the same with every standard library: the engine and std::seed_seq
/// are specified to the bit, the standard's distributions are not.
class Random {
 public:
  Random(std::uint64_t seed, Stream stream) {
    std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                           static_cast<std::uint32_t>(stream)};
    engine_.seed(sequence);
  }

  /// Uniform over [0, 1), in steps of 2^-53.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

  /// Uniform over [lower, upper).
  double uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }

  /// Standard normal (Box and Muller 1958). Each call takes two draws from the engine; the second
  /// normal number that they would give is dropped.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

/// A random number in each of `count` equal parts of [0, 1), ascending. Draws at these parts of a
/// belief have less variance than independent draws.
inline std::vector<double> one_in_each_part(std::size_t count, Random& random) {
  std::vector<double> numbers;
  numbers.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    numbers.push_back((static_cast<double>(i) + random.uniform()) / static_cast<double>(count));
  }
  return numbers;
}

}  // namespace palpate
