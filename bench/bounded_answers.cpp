#include <algorithm>

#include "bounded.hpp"
#include "letters.hpp"

namespace palpate::bench {

Estimate BoundedAnswers::ask(BoundedPosterior& posterior, std::span<const Touch> touches) {
  Estimate estimate;
  milliseconds.push_back(1e3 * seconds_of([&] {
                           posterior.update(touches);
                           estimate = posterior.estimate();
                         }));
  const Certificate& certificate = *estimate.certificate;
  bins_evaluated.push_back(static_cast<double>(certificate.bins_evaluated));
  blocks_bounded.push_back(static_cast<std::int64_t>(certificate.blocks_bounded));
  dropped_mass.push_back(certificate.dropped_mass);
  mode_certain += certificate.mode_certain ? 1 : 0;
  modes.push_back(estimate.mode);
  return estimate;
}

void BoundedAnswers::add(const BoundedAnswers& others) {
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(milliseconds, others.milliseconds);
  append(bins_evaluated, others.bins_evaluated);
  append(blocks_bounded, others.blocks_bounded);
  append(dropped_mass, others.dropped_mass);
  append(modes, others.modes);
  mode_certain += others.mode_certain;
}

Json BoundedAnswers::record() const {
  return {{"milliseconds", milliseconds},
          {"bins_evaluated", bins_evaluated},
          {"blocks_bounded", blocks_bounded},
          {"dropped_mass", dropped_mass},
          {"mode_certain", mode_certain}};
}

BoundedAnswers answer_each(BoundedPosterior& posterior, std::span<const Recording> unknowns) {
  posterior.reset();
  BoundedAnswers().ask(posterior, all_touches(unknowns.front()));
  BoundedAnswers answers;
  for (const Recording& unknown : unknowns) {
    posterior.reset();
    answers.ask(posterior, all_touches(unknown));
  }
  return answers;
}

DenseAnswers answer_each(PoseHistogram& histogram, std::span<const Recording> unknowns) {
  DenseAnswers answers;
  for (const Recording& unknown : unknowns) {
    const std::vector<Touch> touches = all_touches(unknown);
    histogram.reset();
    answers.seconds.push_back(seconds_of([&] {
      histogram.update(touches);
      answers.modes.push_back(histogram.estimate().mode);
    }));
  }
  return answers;
}

std::vector<Measurement> measurements_of(const BoundedAnswers& answers, const std::string& name,
                                         std::int64_t bins_in_all, std::optional<Goal> median_ms) {
  const std::vector<double>& ms = answers.milliseconds;
  const double evaluated = median(answers.bins_evaluated);
  return {{name + ", median", median(ms), "ms", median_ms},
          {name + ", least", std::ranges::min(ms), "ms"},
          {name + ", most", std::ranges::max(ms), "ms"},
          {"bins evaluated, median", evaluated, "bins"},
          {"of all bins", 100.0 * evaluated / static_cast<double>(bins_in_all), "%"},
          {"certificate, largest", std::ranges::max(answers.dropped_mass), "mass"},
          share_of("mode certain", answers.mode_certain, ms.size())};
}

}  // namespace palpate::bench
