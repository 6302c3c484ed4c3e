#include "recognition/evidence_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <tbb/parallel_for.h>

namespace palpate {

namespace {

/// A symmetric matrix over (log mm, log rad).
struct Symmetric {
  double mm = 0.0;
  double mixed = 0.0;
  double rad = 0.0;

  double determinant() const { return mm * rad - mixed * mixed; }
  /// Whether it is positive definite, and not only by chance.
  bool definite() const { return mm > 0.0 && rad > 0.0 && determinant() > 0.1 * mm * rad; }
  std::array<double, 2> solve(const std::array<double, 2>& b) const {
    return {(rad * b[0] - mixed * b[1]) / determinant(),
            (mm * b[1] - mixed * b[0]) / determinant()};
  }
};

/// The derivatives of the log evidence over all unknowns.
struct Slope {
  std::array<double, 2> first{};
  Symmetric information;             ///< negative second derivatives
  std::array<double, 2> complete{};  ///< the information if displacements were observed
  std::vector<SdScore> unknowns;

  void add(const SdScore& score) {
    for (std::size_t k = 0; k < 2; ++k) {
      first[k] += score.mean[k];
      complete[k] += score.complete[k];
    }
    information.mm += score.complete[0] - score.covariance[0];
    information.mixed -= score.covariance[1];
    information.rad += score.complete[1] - score.covariance[2];
    unknowns.push_back(score);
  }
};

/// Newton's step, or where the evidence is not concave three steps of expectation maximisation.
std::array<double, 2> largest_evidence_from(const Slope& slope) {
  constexpr double faster = 3.0;
  return slope.information.definite()
             ? slope.information.solve(slope.first)
             : std::array<double, 2>{faster * slope.first[0] / slope.complete[0],
                                     faster * slope.first[1] / slope.complete[1]};
}

class Search {
 public:
  Search(std::vector<DisplacementPopulation>& unknowns, ReadingModel& readings,
         const SearchRange& range)
      : unknowns_(unknowns), readings_(readings), range_(range), sd_(range.start) {
    double touches = 0.0;
    for (const DisplacementPopulation& unknown : unknowns) {
      touches += static_cast<double>(unknown.touches());
    }
    constexpr double shortest = 0.03;
    constexpr double longest = 0.3;
    longest_step_ = std::clamp(0.5 / std::sqrt(touches / static_cast<double>(unknowns.size())),
                               shortest, longest);
    limit_ = {longest_step_, longest_step_};
  }

  const DisplacementSd& sd() const { return sd_; }
  double longest_step() const { return longest_step_; }

  Slope move(int sweeps) {
    std::vector<SdScore> scores(unknowns_.size());
    tbb::parallel_for(std::size_t{0}, unknowns_.size(),
                      [&](std::size_t i) { scores[i] = unknowns_[i].move(sd_, sweeps); });
    Slope slope;
    for (const SdScore& score : scores) {
      slope.add(score);
    }
    return slope;
  }

  /// Newton's step within limits that halve where the slope changes its sign and grow where it does
  /// not (Riedmiller and Braun 1993): the samples' noise then leads nowhere where evidence is flat.
  std::array<double, 2> next_step(const Slope& slope) {
    constexpr double grow = 1.2;
    constexpr double shrink = 0.5;
    std::array<double, 2> step = largest_evidence_from(slope);
    for (std::size_t k = 0; k < step.size(); ++k) {
      const double change = slope.first[k] * last_slope_[k] < 0.0 ? shrink : grow;
      limit_[k] = std::min(longest_step_, change * limit_[k]);
      last_slope_[k] = slope.first[k];
      step[k] = std::clamp(step[k], -limit_[k], limit_[k]);
    }
    return step;
  }

  /// Carries the samples over to other standard deviations.
  /// @returns the gain in log evidence
  double follow(const std::array<double, 2>& step) {
    const DisplacementSd to{std::max(range_.least.mm, sd_.mm * std::exp(step[0])),
                            std::max(range_.least.rad, sd_.rad * std::exp(step[1]))};
    double gain = 0.0;
    for (DisplacementPopulation& unknown : unknowns_) {
      gain += unknown.reweigh(sd_, to);
    }
    sd_ = to;
    return gain;
  }

  void learn() {
    ReadingModel::Counts counts = readings_.no_counts();
    for (const DisplacementPopulation& unknown : unknowns_) {
      unknown.count(counts);
    }
    readings_.learn(counts);
    tbb::parallel_for(std::size_t{0}, unknowns_.size(),
                      [&](std::size_t i) { unknowns_[i].refresh(); });
  }

 private:
  std::vector<DisplacementPopulation>& unknowns_;
  ReadingModel& readings_;
  SearchRange range_;
  DisplacementSd sd_;
  double longest_step_;
  std::array<double, 2> limit_{};       ///< of the next step
  std::array<double, 2> last_slope_{};  ///< of the log evidence
};

/// The relative error that a wrong width of the touches' likelihoods makes. The evidence knows
/// sd^2 + width^2; the readings' model, which takes elements to be independent, gives width^2
/// within about a quarter (of simulated touches). For Gaussians information / complete is (sd^2 /
/// (sd^2 + width^2))^2.
double error_of_width(double information, double complete) {
  constexpr double off = 0.25;
  const double share = std::sqrt(information / complete);
  return 0.5 * off * (1.0 - share) / share;
}

/// Standard errors of (log mm, log rad): the evidence's curvature and, with enough unknowns, the
/// scatter of their scores, which also holds where elements of a touch depend on each other (White
/// 1982); and the error of the readings' model.
std::array<double, 2> standard_errors(const Slope& slope) {
  constexpr std::size_t enough = 10;
  constexpr double anything = 1.0;  // sd may be anything from 0 on where the evidence is flat
  const bool flat_mm = slope.information.mm <= 0.0;
  const bool flat_rad = slope.information.rad <= 0.0;
  Symmetric information = slope.information;
  if (!information.definite()) {
    information = {flat_mm ? 1.0 : information.mm, 0.0, flat_rad ? 1.0 : information.rad};
  }
  std::array<double, 2> variance{};
  if (slope.unknowns.size() >= enough) {
    for (const SdScore& score : slope.unknowns) {
      const std::array<double, 2> part = information.solve(score.mean);
      variance[0] += part[0] * part[0];
      variance[1] += part[1] * part[1];
    }
  } else {
    variance = {information.solve({1.0, 0.0})[0], information.solve({0.0, 1.0})[1]};
  }
  const auto error = [&](bool flat, double its_variance, double its_information, double complete) {
    return flat ? anything
                : std::hypot(std::sqrt(its_variance), error_of_width(its_information, complete));
  };
  return {error(flat_mm, variance[0], information.mm, slope.complete[0]),
          error(flat_rad, variance[1], information.rad, slope.complete[1])};
}

}  // namespace

LargestEvidence find_largest_evidence(std::vector<DisplacementPopulation>& unknowns,
                                      ReadingModel& readings, const SearchRange& range,
                                      const std::function<void(double)>& progress) {
  constexpr int settling_sweeps = 100;  // from the bins' centres to their own posterior
  constexpr int most_steps = 60;
  constexpr int averaged_steps = 8;
  constexpr double small_step = 0.03;  // 3 %, about what the samples' noise moves
  constexpr double of_an_error = 0.3;  // steps far below the standard error lead nowhere
  Search search(unknowns, readings, range);
  const DisplacementSd& least = range.least;
  const double whole_way = std::log(range.start.mm / least.mm) / search.longest_step();
  int done = 0;
  const auto show = [&] {
    if (progress) {
      progress(std::min(1.0, ++done / (whole_way + averaged_steps)));
    }
  };

  search.move(settling_sweeps);
  LargestEvidence result;
  int small_steps = 0;
  for (int i = 0; i < most_steps && !result.ended; ++i) {
    const Slope slope = search.move(range.sweeps);
    const std::array<double, 2> step = search.next_step(slope);
    search.follow(step);
    search.learn();
    show();
    const auto rests = [&](double part, double information, double sd, double lowest) {
      const double enough =
          std::max(small_step, information > 0.0 ? of_an_error / std::sqrt(information) : 0.0);
      return std::abs(part) < enough || (sd <= lowest && part < 0.0);
    };
    small_steps = rests(step[0], slope.information.mm, search.sd().mm, least.mm) &&
                          rests(step[1], slope.information.rad, search.sd().rad, least.rad)
                      ? small_steps + 1
                      : 0;
    result.ended = small_steps == 3;
  }

  std::array<double, 2> mean_log{};
  std::vector<SdScore> scores(unknowns.size());
  for (int i = 0; i < averaged_steps; ++i) {
    const Slope slope = search.move(range.sweeps);
    for (std::size_t u = 0; u < unknowns.size(); ++u) {
      scores[u].add(slope.unknowns[u], 1.0 / averaged_steps);
    }
    mean_log[0] += std::log(search.sd().mm) / averaged_steps;
    mean_log[1] += std::log(search.sd().rad) / averaged_steps;
    search.follow(search.next_step(slope));
    show();
  }
  Slope mean;
  for (const SdScore& score : scores) {
    mean.add(score);
  }
  // The slope is linear over these steps, so that its mean belongs to their mean place.
  const std::array<double, 2> rest = largest_evidence_from(mean);
  for (std::size_t k = 0; k < rest.size(); ++k) {
    mean_log[k] += std::clamp(rest[k], -search.longest_step(), search.longest_step());
  }
  const std::array<double, 2> relative = standard_errors(mean);
  constexpr double at_the_end = 1.1;
  const auto set_sd = [&](double log_sd, double lowest, double error, double& sd,
                          double& standard_error) {
    const bool exact = std::exp(log_sd) < at_the_end * lowest;
    sd = exact ? 0.0 : std::exp(log_sd);
    standard_error = sd * error;
  };
  set_sd(mean_log[0], least.mm, relative[0], result.sd.mm, result.standard_error.mm);
  set_sd(mean_log[1], least.rad, relative[1], result.sd.rad, result.standard_error.rad);

  while (search.sd().mm > least.mm || search.sd().rad > least.rad) {
    result.gain -= search.follow({-search.longest_step(), -search.longest_step()});
    search.move(std::max(1, range.sweeps / 4));  // one number of nats needs no more
    show();
  }
  return result;
}

}  // namespace palpate
