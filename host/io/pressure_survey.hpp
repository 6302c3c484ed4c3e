#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "io/extremes.hpp"
#include "io/reading_histogram.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// What one element reads over all rows of a recording. Rows in which the element is dead or
/// Unknown do not count.
struct ElementSurvey {
  std::uint64_t known = 0;      ///< rows with a known reading
  std::uint64_t alive = 0;      ///< rows in which the element is not dead
  std::uint64_t changes = 0;    ///< known readings that differ from the known reading before
  std::uint64_t zeros = 0;      ///< readings of exactly 0
  std::uint64_t contacts = 0;   ///< readings above the threshold
  std::uint64_t strongest = 0;  ///< rows in contact in which it reads the most of all elements
  double last = 0.0;            ///< the last known reading

  bool constant() const { return known > 0 && changes == 0; }
};

/// Surveys the pressures of a recording, which come row by row in pieces that may end anywhere.
/// Holds some tens of bytes for each element, and nothing for a row.
class PressureSurvey {
 public:
  /// @param threshold a reading further above the baseline counts as contact; none where no
  /// threshold is known: every row then counts as in contact
  void begin(std::size_t elements, std::optional<double> threshold);
  /// Takes the next pressures of [n, e].
  /// @param head the recording's, with its `rows`, `valid` and `baseline`
  void add(const Recording& head, std::span<const double> pressures);

  const std::vector<ElementSurvey>& elements() const { return elements_; }  ///< [e]
  const ReadingHistogram& readings() const { return readings_; }
  /// Extremes of the known readings of living elements; none where there are no such readings.
  const std::optional<Extremes>& range() const { return range_; }
  std::uint64_t unknown() const { return unknown_; }        ///< NaN readings of living elements
  std::uint64_t in_contact() const { return in_contact_; }  ///< rows
  std::uint64_t at_most() const { return at_most_; }  ///< readings equal to the largest reading
  /// Separate times at which the array reads the largest reading. Frames that follow each other are
  /// one time; each touch is a time of its own.
  std::uint64_t times_at_most() const { return times_at_most_; }

 private:
  void take(const Recording& head, double reading);
  void end_row();

  std::optional<double> threshold_;
  std::vector<ElementSurvey> elements_;
  ReadingHistogram readings_;
  std::optional<Extremes> range_;
  std::uint64_t unknown_ = 0;
  std::uint64_t in_contact_ = 0;
  std::uint64_t at_most_ = 0;
  std::uint64_t times_at_most_ = 0;
  std::uint64_t last_at_most_ = 0;  ///< last row with the largest reading
  std::uint64_t row_ = 0;
  std::size_t element_ = 0;            ///< index of the next pressure in its row
  std::optional<double> strongest_;    ///< largest pressure above the baseline in this row
  std::size_t strongest_element_ = 0;  ///< that has it
};

}  // namespace palpate
