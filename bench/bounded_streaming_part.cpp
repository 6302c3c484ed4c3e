#include <algorithm>

#include <fmt/format.h>

#include "bounded.hpp"
#include "letters.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t streaming_seed = 1'401'000'000;
constexpr double budget_s = 0.1;
constexpr double most_dropped_first = 1e-2;

/// Least share of the first touches whose dropped mass is small, in percent: 16 of 20.
constexpr double least_share_first = 80.0;

void add_case(const BoundedAnswers& answers, const std::string& touches, std::int64_t bins,
              const std::optional<Goal>& median_ms, bool first, Report& report) {
  const std::vector<double>& dropped = answers.dropped_mass;
  Case measured{
      .name = "streaming, " + touches,
      .facts = {{"bins in all", bins}, {"answers", dropped.size()}},
      .measurements = measurements_of(answers, "from touch to estimate", bins, median_ms)};
  measured.measurements.push_back({"dropped mass, median", median(dropped), "mass"});
  const auto small = [&](double most) {
    return static_cast<int>(
        std::ranges::count_if(dropped, [most](double mass) { return mass <= most; }));
  };
  measured.measurements.push_back(
      first ? share_of(fmt::format("dropped mass at most {}", most_dropped_first),
                       small(most_dropped_first), dropped.size(), at_least(least_share_first))
            : share_of("dropped mass within the tolerance", small(BoundedOptions{}.tolerance),
                       dropped.size()));
  report.add(measured);
}

}  // namespace

Json measure_bounded_streaming(const BoundedInputs& inputs, Report& report) {
  const PoseLattice lattice = inputs.quick ? lattice_of(10, 10, 8) : lattice_of(200, 200, 250);
  const std::int64_t bins = inputs.bins_in_all(lattice);
  BoundedPosterior posterior(inputs.letters, {.lattice = lattice, .budget_s = budget_s});
  std::vector<BoundedAnswers> after(touches_per_unknown);  // [touch]
  const std::vector<Recording> unknowns =
      unknown_recordings(inputs.unknowns(), touches_per_unknown, streaming_seed);
  BoundedAnswers().ask(posterior, all_touches(unknowns.front()));  // warms up
  for (const Recording& unknown : unknowns) {
    posterior.reset();
    for (std::size_t i = 0; i < after.size(); ++i) {
      after[i].ask(posterior, unknown.touches(i, i + 1));
    }
  }
  BoundedAnswers later;
  for (std::size_t i = 2; i < after.size(); ++i) {
    later.add(after[i]);
  }
  // The budget is for the search. The touch is taken in before.
  add_case(after[0], "touch 1", bins, at_most(1.1e3 * budget_s), true, report);
  add_case(after[1], "touch 2", bins, at_most(40.0), false, report);
  add_case(later, fmt::format("touches 3 to {}", after.size()), bins, at_most(20.0), false, report);
  Json records = Json::array();
  for (std::size_t i = 0; i < after.size(); ++i) {
    Json record{{"touch", i + 1}, {"bins_in_all", bins}, {"budget_s", budget_s}};
    record.update(after[i].record());
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace palpate::bench
