#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

/// Counts readings in bins that are at most 0.8 % of a reading wide, in 512 KiB whatever the number
/// of readings. A bin holds the numbers that agree in the first 16 bits of a float: sign, exponent
/// and 7 bits of the mantissa.
class ReadingHistogram {
 public:
  ReadingHistogram();

  /// Counts a reading that is no NaN.
  void add(double reading) { ++counts_[bin_of(reading)]; }

  /// Returns the reading below which the fraction `part` of all readings lie, rounded towards 0 to
  /// the edge of its bin: whole numbers up to 256 are exact. At least one reading is counted.
  double quantile(double part) const;
  /// Counts the readings in the bins of `low`, of `high` and between them.
  std::uint64_t count(double low, double high) const;
  /// Counts the bins with readings from the bin of `low` to the bin of `high`.
  std::uint64_t occupied(double low, double high) const;

 private:
  static std::size_t bin_of(double reading);
  static double edge_of(std::size_t bin);

  std::vector<std::uint64_t> counts_;
};

}  // namespace palpate
