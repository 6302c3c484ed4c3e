#pragma once

#include <optional>
#include <string>
#include <vector>

#include "measurement.hpp"
#include "table.hpp"

namespace palpate::bench {

/// What a measured value is held against.
struct Goal {
  enum class Kind { at_most, at_least } kind = Kind::at_most;
  double value = 0.0;
};
inline Goal at_most(double value) { return {Goal::Kind::at_most, value}; }
inline Goal at_least(double value) { return {Goal::Kind::at_least, value}; }

struct Measurement {
  std::string name;
  double value = 0.0;
  std::string unit;
  std::optional<Goal> goal = {};
  std::optional<Interval> interval = {};  ///< of the value, 95 %

  bool reached() const;
};
/// `count` of `trials` in percent, with its 95 % score interval (Wilson).
Measurement share_of(const std::string& name, int count, std::size_t trials,
                     std::optional<Goal> goal = {});
/// Name, value and unit; the goal, and whether it is reached; the interval.
Json record_of(const Measurement& measurement);

/// What was measured in one case. `facts` are its sizes and whatever else explains the numbers.
struct Case {
  std::string name;
  Json facts;
  std::vector<Measurement> measurements = {};
};

/// Prints every case as rows of one Markdown table, as soon as it is known, and keeps all of them.
class Report {
 public:
  /// Prints the table's head.
  explicit Report(Json facts);

  void add(const Case& measured);
  /// The facts, and `cases`.
  const Json& document() const { return document_; }

 private:
  Json document_;
};

}  // namespace palpate::bench
