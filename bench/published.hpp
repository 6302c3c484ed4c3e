#pragma once

/// What the paper reports in Sec. IV and V, of letters that it touched with a real sensor.
namespace palpate::bench::published {

inline constexpr int bins_1000_know_after = 46;    ///< touches to an accuracy of 100 %
inline constexpr int bins_10000_know_after = 9;    ///< the same
inline constexpr double error_mm = 1.3;            ///< mean, of the histogram filter
inline constexpr double particle_accuracy = 0.74;  ///< where 10,000 particles level out

}  // namespace palpate::bench::published
