// Highway compiles this file once for every set of vector instructions. Lanes are never mixed, so
// that every set gives the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "learning/plane_sums.cpp"
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "learning/plane_sums.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Numbers = hn::CappedTag<float, sum_lanes>;

/// Sums `rows` rows of sum_lanes columns, which stay in registers meanwhile.
template <std::size_t rows>
HWY_INLINE void SumPiece(const float* const* planes, std::size_t count, std::size_t begin,
                         std::size_t width, std::size_t columns, float* sums) {
  const Numbers d;
  constexpr std::size_t lanes = hn::MaxLanes(Numbers());
  constexpr std::size_t parts = sum_lanes / lanes;
  hn::Vec<Numbers> sum[rows * parts];
  for (auto& one : sum) {
    one = hn::Zero(d);
  }
  for (std::size_t k = 0; k < count; ++k) {
    const float* piece = planes[k] + begin;
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t part = 0; part < parts; ++part) {
        auto& one = sum[row * parts + part];
        one = hn::Add(one, hn::LoadU(d, piece + row * width + part * lanes));
      }
    }
  }
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t part = 0; part < parts; ++part) {
      hn::StoreU(sum[row * parts + part], d, sums + row * columns + part * lanes);
    }
  }
}

void SumPlanes(const float* const* planes, std::size_t count, std::size_t width, std::size_t rows,
               std::size_t columns, float* sums) {
  // So many sums at once that an addition need not wait for the one before it.
  constexpr std::size_t together = HWY_MAX(1, 8 * hn::MaxLanes(Numbers()) / sum_lanes);
  std::size_t row = 0;
  for (; row + together <= rows; row += together) {
    for (std::size_t i = 0; i < columns; i += sum_lanes) {
      SumPiece<together>(planes, count, row * width + i, width, columns, sums + row * columns + i);
    }
  }
  for (; row < rows; ++row) {
    for (std::size_t i = 0; i < columns; i += sum_lanes) {
      SumPiece<1>(planes, count, row * width + i, width, columns, sums + row * columns + i);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace palpate {

HWY_EXPORT(SumPlanes);

void sum_planes(std::span<const float* const> planes, std::size_t width, std::size_t rows,
                std::size_t columns, float* sums) {
  HWY_DYNAMIC_DISPATCH(SumPlanes)(planes.data(), planes.size(), width, rows, columns, sums);
}

}  // namespace palpate
#endif  // HWY_ONCE
