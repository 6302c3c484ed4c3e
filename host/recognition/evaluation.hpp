#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace palpate {

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

/// The 95 % score interval of a probability of which `successes` of `trials` are known (Wilson
/// 1927). Unlike the normal approximation's it is not empty where all or none succeed.
/// trials > 0; `successes` may be a fraction, of an estimate that varies no more than a binomial's.
Interval wilson_interval(double successes, std::size_t trials);

/// The fraction of all pairs, of a value of one kind and one of the other, in which the value of
/// `lower` is the lower one (the area under the ROC curve); a tie counts half. Neither is empty.
double told_apart(std::span<const double> lower, std::span<const double> higher);

/// Standard error of told_apart() of so many values of each kind (Hanley and McNeil 1982, eq. 1,
/// with the variances of exponentially distributed values); 0 for an area of 0 or 1.
double told_apart_error(double area, std::size_t lower, std::size_t higher);

/// What was believed of an unknown whose true label is known. Its class is known where some map had
/// the label, and unknown where none had it; the right answer is then "(none)".
struct JudgedRecord {
  std::string truth;                       ///< label of the true object
  std::string best;                        ///< label of the largest probability
  std::map<std::string, double> identity;  ///< {label: probability}; has `best`, sums to 1
  std::optional<double> none;              ///< probability of "(none)"
  std::optional<double> fit_z;             ///< see Fit
  std::optional<double> error_mm;          ///< pose error of the mode
  std::optional<double> refined_error_mm;  ///< pose error of the refined pose

  bool of_known_class() const;
  /// The right answer: the true label, or "(none)".
  std::string answer() const;
  bool right() const { return best == answer(); }
  /// Probability of `best`.
  double confidence() const { return identity.at(best); }
  /// Probability of the right answer; 0 where it was not among the answers.
  double answer_probability() const;
};

/// How many of some records are right.
struct Counted {
  std::size_t records = 0;
  std::size_t right = 0;

  /// Where there are records.
  double accuracy() const { return static_cast<double>(right) / static_cast<double>(records); }
  Interval interval() const { return wilson_interval(static_cast<double>(right), records); }
};

/// The records whose best label has a probability in [lower, upper); the last bin includes 1.
struct ReliabilityBin : Counted {
  double lower = 0.0;
  double upper = 0.0;
  double mean_confidence = 0.0;  ///< where there are records
};

/// The smallest probability of a right answer that log_loss counts with: an answer that was held
/// impossible costs 27.6 nats, not infinitely many.
inline constexpr double least_answer_probability = 1e-12;

/// How right, and how honest, a set of records is.
struct Scores : Counted {
  double log_loss = 0.0;  ///< mean of -log(probability of the right answer), nats
  /// Expected calibration error: the mean over the records of how far the accuracy of their bin is
  /// from its mean confidence.
  double calibration_error = 0.0;
  std::array<ReliabilityBin, 10> bins;
};

/// The records of one true label, those where its class was known apart from those where not. Those
/// of an unknown class are right where they were called "(none)".
struct ClassScores : Counted {
  std::string label;
  bool known = true;
  std::vector<std::size_t> taken;  ///< [answer] how often each was the best label
};

/// Area under the curve (ROC) of records of known against those of unknown classes by a score that
/// is larger for known ones: the probability that the one of the known class has the larger score;
/// a tie counts half.
struct KnownAgainstUnknown {
  std::string score;      ///< "1 - none" or "fit.z", by the fields of a record
  std::size_t known = 0;  ///< records that have the score
  std::size_t unknown = 0;
  double area = 0.0;
  double standard_error = 0.0;  ///< see told_apart_error()

  std::size_t records() const { return known + unknown; }
};

struct Median {
  std::size_t count = 0;
  double value = 0.0;  ///< mean of the middle two of an even count
};

struct Evaluation {
  Scores all;
  std::optional<Scores> known;    ///< of known classes alone, where others are among the records
  std::optional<Scores> unknown;  ///< of unknown classes; `right` counts those called "(none)"
  /// By the score that most records have, "1 - none" among equals; only where records of both kinds
  /// of classes have one.
  std::optional<KnownAgainstUnknown> known_against_unknown;
  /// Labels of known classes among the records, and what else was some record's best; last
  /// "(none)", where it was possible.
  std::vector<std::string> answers;
  std::vector<ClassScores> classes;  ///< known ones first, each kind by label
  std::optional<Median> error_mm;    ///< over the records that have one
  std::optional<Median> refined_error_mm;
};

/// Compares records with the truth. There must be at least one.
Evaluation evaluate(std::span<const JudgedRecord> records);

}  // namespace palpate
