// The likelihood of bins by a table over log odds, for files that are compiled once for every set
// of instructions.

#if defined(PALPATE_TABLE_LOOK_UP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef PALPATE_TABLE_LOOK_UP_INL
#undef PALPATE_TABLE_LOOK_UP_INL
#else
#define PALPATE_TABLE_LOOK_UP_INL
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>

#include <hwy/highway.h>

#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "estimation/bounded/leaves/map_patches.hpp"
#include "estimation/bounded/leaves/patch_interpolation-inl.hpp"
#include "estimation/bounded/leaves/reading_form.hpp"
#include "model/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

/// A level of a table of log-likelihoods.
template <class D>
class TableRow {
 public:
  TableRow(D d, const ReadingForm& form, std::size_t object, Reading level)
      : row_(form.row(object, level)),
        first_(hn::Set(d, form.first_log_odds)),
        scale_(hn::Set(d, form.nodes_per_nat)),
        last_(hn::Set(d, static_cast<double>(form.nodes - 1))),
        last_segment_(hn::Set(d, static_cast<double>(form.nodes - 2))) {}

  HWY_INLINE hn::Vec<D> at(D d, hn::Vec<D> l) const {
    const auto at = hn::Max(hn::Zero(d), hn::Min(hn::Mul(hn::Sub(l, first_), scale_), last_));
    const auto segment = hn::Min(hn::Floor(at), last_segment_);
    const auto index =
        hn::BitCast(hn::RebindToSigned<D>(), whole_number(d, hn::Add(segment, segment)));
    const auto value = hn::GatherIndex(d, row_, index);
    const auto difference = hn::GatherIndex(d, row_ + 1, index);
    return hn::Add(value, hn::Mul(difference, hn::Sub(at, segment)));
  }

 private:
  const double* row_;
  hn::Vec<D> first_;
  hn::Vec<D> scale_;
  hn::Vec<D> last_;
  hn::Vec<D> last_segment_;
};

/// The bins of one vector, by a table of log-likelihoods.
/// @param log_odds_at (element): in every lane
template <class D, class LogOddsAt>
void look_up_lanes(D d, const LogOddsAt& log_odds_at, std::size_t object,
                   std::span<const ReadingRun> runs, const ReadingForm& form,
                   double* log_likelihood) {
  auto sum = hn::Zero(d);
  for (const ReadingRun& run : runs) {
    const TableRow table(d, form, object, run.reading);
    for (std::size_t e = run.begin; e < run.end; ++e) {
      sum = hn::Add(sum, table.at(d, log_odds_at(e)));
    }
  }
  hn::StoreU(sum, d, log_likelihood);
}

/// The only bin of a block, by a table: a vector holds elements. The bits are look_up_lanes()'s.
/// @param elements padded; x is overwritten
template <class D>
void look_up_elements(D d, const MapPatches& map, std::size_t object,
                      ElementPatches<double>& elements, std::span<const ReadingRun> runs,
                      const ReadingForm& form, double* log_likelihood) {
  const hn::Rebind<std::int32_t, D> di;
  const hn::Rebind<float, D> df;
  const auto marker = hn::Set(d, static_cast<double>(map.marker()));
  const auto prior = hn::Set(d, map.prior_log_odds());
  double* const values = elements.x.data();
  for (std::size_t e = 0; e < elements.x.size(); e += hn::Lanes(d)) {
    const auto stored = hn::LoadU(di, elements.patch.data() + e);
    const auto patch = hn::IfThenElse(hn::Lt(stored, hn::Zero(di)), hn::Not(stored), stored);
    static_assert(MapPatches::side == 4);
    const auto first = hn::ShiftLeft<2>(patch);
    const auto node = [&](int index) HWY_ATTR {
      const auto of_map = hn::PromoteTo(d, hn::GatherIndex(df, map.nodes() + index, first));
      return hn::IfThenElse(hn::Eq(of_map, marker), prior, of_map);
    };
    const auto l =
        bilinear(node(0), node(1), node(MapPatches::side), node(MapPatches::side + 1),
                 hn::LoadU(d, elements.x.data() + e), hn::LoadU(d, elements.y.data() + e));
    hn::StoreU(l, d, values + e);
  }
  double sum = 0.0;
  for (const ReadingRun& run : runs) {
    const TableRow table(d, form, object, run.reading);
    std::size_t e = run.begin;
    for (; e + hn::Lanes(d) <= run.end; e += hn::Lanes(d)) {
      hn::StoreU(table.at(d, hn::LoadU(d, values + e)), d, values + e);
    }
    if (e < run.end) {
      HWY_ALIGN double rest[most_lanes] = {};
      std::copy(values + e, values + run.end, rest);
      hn::Store(table.at(d, hn::Load(d, rest)), d, rest);
      std::copy(rest, rest + (run.end - e), values + e);
    }
    sum = std::accumulate(values + run.begin, values + run.end, sum);
  }
  *log_likelihood = sum;
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#endif
