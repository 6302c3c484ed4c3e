#include "io/reading_histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

namespace palpate {

namespace {

constexpr std::uint32_t sign = 0x80000000;

}  // namespace

ReadingHistogram::ReadingHistogram() : counts_(1 << 16, 0) {}

// The bits of floats, read as whole numbers, have the floats' order where the sign bit is flipped
// and the other bits of negative numbers are flipped too.
std::size_t ReadingHistogram::bin_of(double reading) {
  constexpr double largest = std::numeric_limits<float>::max();
  const auto number = static_cast<float>(std::clamp(reading, -largest, largest));
  const auto bits = std::bit_cast<std::uint32_t>(number + 0.0F);  // 0 for -0
  return ((bits & sign) != 0 ? ~bits : bits | sign) >> 16;
}

double ReadingHistogram::edge_of(std::size_t bin) {
  const auto key = static_cast<std::uint32_t>(bin) << 16;
  return std::bit_cast<float>((key & sign) != 0 ? key ^ sign : ~key & 0xFFFF0000);
}

double ReadingHistogram::quantile(double part) const {
  const std::uint64_t all = std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
  const double below = std::max(1.0, std::ceil(part * static_cast<double>(all)));
  std::uint64_t passed = 0;
  for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
    passed += counts_[bin];
    if (static_cast<double>(passed) >= below) {
      return edge_of(bin);
    }
  }
  return edge_of(counts_.size() - 1);
}

std::uint64_t ReadingHistogram::count(double low, double high) const {
  std::uint64_t sum = 0;
  for (std::size_t bin = bin_of(low); bin <= bin_of(high); ++bin) {
    sum += counts_[bin];
  }
  return sum;
}

std::uint64_t ReadingHistogram::occupied(double low, double high) const {
  std::uint64_t bins = 0;
  for (std::size_t bin = bin_of(low); bin <= bin_of(high); ++bin) {
    bins += counts_[bin] > 0 ? 1 : 0;
  }
  return bins;
}

}  // namespace palpate
