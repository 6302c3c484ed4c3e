#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "measurement.hpp"

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

/// One case: what was run, and what was measured. `facts` are its sizes and whatever else explains
/// the numbers.
struct Case {
  std::string name;
  nlohmann::ordered_json facts;
  std::vector<Measurement> measurements = {};
};

/// Prints every case as rows of one Markdown table, as soon as it is known, and keeps all of them.
class Report {
 public:
  /// Prints the table's head below a line per fact, such as the device and the command line.
  explicit Report(nlohmann::ordered_json facts);

  void add(const Case& measured);
  /// The facts, and `cases`.
  const nlohmann::ordered_json& document() const { return document_; }

 private:
  nlohmann::ordered_json document_;
};

}  // namespace palpate::bench
