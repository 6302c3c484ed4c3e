#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "letters.hpp"
#include "own_sweep.hpp"

namespace palpate::bench {

namespace {

using ErrorsOf = TrialErrors PoseErrors::*;

/// Sums of squares over the unknowns of which a run and the finest run have the same object.
struct Squares {
  double distances = 0.0;  ///< of the run's poses from those of the finest run, mm^2
  double errors = 0.0;     ///< of the finest run's poses, mm^2
};

Squares squares_of(const OwnRun& run, const OwnRun& finest, ErrorsOf errors, bool by_truth) {
  Squares squares;
  for (std::size_t i = 0; i < finest.steps.size(); ++i) {
    const std::optional<double>& distance = (run.from_finest.*errors)[i];
    const std::optional<double>& error = (finest.errors.*errors)[i];
    const auto sd = finest.steps[i].sd();
    if (!distance || (by_truth ? !error : !sd)) {
      continue;
    }
    squares.distances += *distance * *distance;
    squares.errors += by_truth ? *error * *error : (*sd)[0] * (*sd)[0] + (*sd)[1] * (*sd)[1];
  }
  return squares;
}

/// Unknowns that the run has right or, where no label is known, as the finest run has them.
double recognised(const OwnRun& run) {
  const Json& accuracy = run.record.at("accuracy");
  return accuracy.is_null() ? run.record.at("same_object") : accuracy;
}

/// Whether a run's poses rest where those of the finest run are: an error e and a distance d make
/// sqrt(e^2 + d^2) together.
bool rests(const OwnRun& run, const OwnRun& finest, ErrorsOf errors, bool by_truth) {
  const Squares squares = squares_of(run, finest, errors, by_truth);
  return squares.errors > 0.0 && std::sqrt(squares.errors + squares.distances) <=
                                     (1.0 + least_gain) * std::sqrt(squares.errors);
}

std::optional<std::size_t> first_that_suffices(std::span<const OwnRun> runs, ErrorsOf errors,
                                               bool by_truth) {
  const OwnRun& finest = runs.back();
  std::optional<std::size_t> first;
  double most = recognised(finest);
  for (std::size_t i = runs.size() - 1; i-- > 0;) {
    if (recognised(runs[i]) < most || !rests(runs[i], finest, errors, by_truth)) {
      break;
    }
    most = std::max(most, recognised(runs[i]));
    first = i;
  }
  return first;
}

std::string count_of(const OwnRun& run) { return count_text(run.record.at("count")); }

std::string cost_words(const OwnRun& run) {
  const Json& histogram = run.record.at("seconds_histogram");
  const Json& bounds = run.record.at("seconds_bounds");
  std::string text;
  if (!histogram.is_null()) {
    text = fmt::format("{} by the histogram", seconds_text(histogram));
  }
  if (!bounds.is_null()) {
    text += fmt::format("{}{} by bounds", text.empty() ? "" : " and ", seconds_text(bounds));
  }
  return text;
}

}  // namespace

OwnAdvice advice_of(std::span<const OwnRun> runs, const OwnData& data) {
  const std::vector<double> errors_mm = present(runs.back().errors.mode_mm);
  const bool by_truth = errors_mm.size() >= least_true_poses;
  OwnAdvice advice{.mode = first_that_suffices(runs, &PoseErrors::mode_mm, by_truth),
                   .refined = first_that_suffices(runs, &PoseErrors::refined_mm, by_truth),
                   .sentence = {}};
  const OwnRun& advised = advice.refined ? runs[*advice.refined] : runs.back();
  const std::string flags = flags_of(advised.lattice, data.task.auto_pivot);
  const std::string count = count_of(advised);
  advice.sentence =
      advice.refined
          ? fmt::format(
                "Beyond {} bins per object ({}) neither recognition nor the refined pose "
                "improves; the mode {}.",
                count, flags,
                advice.mode ? fmt::format("needs {}", count_of(runs[*advice.mode]))
                            : "gains up to the finest bins")
          : fmt::format(
                "Poses move up to the finest bins, {} per object ({}): give a larger "
                "--max-bins, or a smaller region.",
                count, flags);
  advice.sentence += fmt::format(
      "\nAn unknown then costs {}. --bins auto takes {} = {}, and --bins fine {} = {}.",
      cost_words(advised), size_of(data.automatic),
      count_text(static_cast<double>(data.automatic.bins())), size_of(data.task.lattice()),
      count_text(static_cast<double>(data.task.lattice().bins())));
  return advice;
}

}  // namespace palpate::bench
