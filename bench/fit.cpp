#include <array>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "command_run.hpp"
#include "fit_run.hpp"
#include "report.hpp"

namespace palpate::bench {

namespace {

std::string name_of(const FitSetting& setting, const FitRun& run) {
  return fmt::format("{}, touch {}", setting.name, run.touches);
}

Case case_of(const FitSetting& setting, const FitRun& run) {
  const Interval apart = run.told_apart_interval();
  Case result{
      .name = name_of(setting, run),
      .facts = {{"learned", run.learned.z.size()}, {"never learned", run.unlearned.z.size()}},
      .measurements = {{.name = "unlearned fit worse than learned",
                        .value = 100.0 * run.told_apart(),
                        .unit = "% of pairs",
                        .interval = Interval{100.0 * apart.low, 100.0 * apart.high}}}};
  for (const auto& [unknowns, fits] :
       {std::pair("learned", &run.learned), std::pair("never learned", &run.unlearned)}) {
    for (const auto& [verdict, words] :
         {std::pair(Verdict::fits, "fits"), std::pair(Verdict::doubtful, "doubtful"),
          std::pair(Verdict::does_not_fit, "does not fit")}) {
      result.measurements.push_back(
          share_of(fmt::format("{}: {}", unknowns, words), fits->count(verdict), fits->z.size()));
    }
  }
  return result;
}

}  // namespace

void measure_fit(const FitOptions& options, std::span<char* const> command_line) {
  require_at_least("--trials", options.trials, 1);
  CommandRun run(options, {{"--json", options.json}}, command_line);
  const int trials_each = options.trials.value_or(options.quick ? 2 : 20);
  constexpr std::array touches = {1, 3, 5, 9};
  std::vector<FitSetting> settings = fit_settings();
  if (options.quick) {
    settings.resize(2);  // the two arrays
  }
  Report report(run.facts());
  Json fits = Json::array();
  for (const FitSetting& setting : settings) {
    for (const FitRun& after : run_fit(run.device(), setting, trials_each, touches)) {
      report.add(case_of(setting, after));
      fits.push_back({{"name", name_of(setting, after)},
                      {"learned_z", after.learned.z},
                      {"unlearned_z", after.unlearned.z}});
    }
  }
  Json document = report.document();
  document["fits"] = std::move(fits);
  run.write(options.json, document.dump(2) + "\n");
}

}  // namespace palpate::bench
