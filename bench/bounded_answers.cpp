#include "bounded_answers.hpp"

#include <algorithm>
#include <cmath>

#include "letters.hpp"

namespace palpate::bench {

namespace {

template <typename Field>
std::vector<double> each(const std::vector<BoundedAnswer>& answers, Field field) {
  std::vector<double> values;
  for (const BoundedAnswer& answer : answers) {
    values.push_back(static_cast<double>(field(answer)));
  }
  return values;
}

}  // namespace

BoundedAnswer answer(BoundedPosterior& posterior, std::span<const Touch> touches) {
  BoundedAnswer answer;
  answer.seconds = seconds_of([&] {
    posterior.update(touches);
    answer.estimate = posterior.estimate();
  });
  return answer;
}

std::vector<double> BoundedAnswers::milliseconds() const {
  return each(all, [](const BoundedAnswer& answer) { return 1e3 * answer.seconds; });
}

std::vector<double> BoundedAnswers::bins_evaluated() const {
  return each(all, [](const BoundedAnswer& answer) { return answer.certificate().bins_evaluated; });
}

std::vector<double> BoundedAnswers::dropped_masses() const {
  return each(all, [](const BoundedAnswer& answer) { return answer.certificate().dropped_mass; });
}

int BoundedAnswers::with_certain_mode() const {
  return static_cast<int>(std::ranges::count_if(
      all, [](const BoundedAnswer& answer) { return answer.certificate().mode_certain; }));
}

BoundedAnswers answer_each(BoundedPosterior& posterior, std::span<const Recording> unknowns) {
  BoundedAnswers answers;
  posterior.reset();
  answer(posterior, all_touches(unknowns.front()));
  for (const Recording& unknown : unknowns) {
    posterior.reset();
    answers.all.push_back(answer(posterior, all_touches(unknown)));
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

int same_modes(const BoundedAnswers& bounded, const DenseAnswers& dense) {
  constexpr double one_likelihood = 1e-3;
  int same = 0;
  for (std::size_t i = 0; i < dense.modes.size(); ++i) {
    const Mode& a = bounded.all[i].estimate.mode;
    const Mode& b = dense.modes[i];
    const bool one_bin = a.object == b.object && a.bin == b.bin;
    same += one_bin || std::abs(a.log_likelihood - b.log_likelihood) < one_likelihood ? 1 : 0;
  }
  return same;
}

double table_seconds(std::span<const Hypothesis> objects, const BoundedOptions& options,
                     const Recording& unknown, int repeats) {
  const std::vector<Touch> touches = all_touches(unknown);
  std::vector<double> seconds;
  for (int i = 0; i < repeats; ++i) {
    std::optional<BoundedPosterior> posterior;
    const double first = seconds_of([&] {
      posterior.emplace(objects, options);
      answer(*posterior, touches);
    });
    posterior->reset();
    seconds.push_back(first - answer(*posterior, touches).seconds);
  }
  return median(seconds);
}

std::vector<Measurement> measurements_of(const BoundedAnswers& answers, const std::string& name,
                                         std::int64_t bins_in_all, std::optional<Goal> median_ms) {
  const std::vector<double> ms = answers.milliseconds();
  const double evaluated = median(answers.bins_evaluated());
  return {{name + ", median", median(ms), "ms", median_ms},
          {name + ", least", std::ranges::min(ms), "ms"},
          {name + ", most", std::ranges::max(ms), "ms"},
          {"bins evaluated, median", evaluated, "bins"},
          {"of all bins", 100.0 * evaluated / static_cast<double>(bins_in_all), "%"},
          {"certificate, largest", std::ranges::max(answers.dropped_masses()), "mass"},
          share_of("mode certain", answers.with_certain_mode(), answers.all.size())};
}

Json record_of(const BoundedAnswers& answers) {
  Json blocks = Json::array();
  for (const BoundedAnswer& answer : answers.all) {
    blocks.push_back(answer.certificate().blocks_bounded);
  }
  return {{"milliseconds", answers.milliseconds()},
          {"bins_evaluated", answers.bins_evaluated()},
          {"blocks_bounded", blocks},
          {"dropped_mass", answers.dropped_masses()},
          {"mode_certain", answers.with_certain_mode()}};
}

}  // namespace palpate::bench
