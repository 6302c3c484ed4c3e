#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/pressure_table.hpp"
#include "streaming/table_import.hpp"

namespace palpate {

/// What an import has to know of all readings; it needs no readings but those of the next rows.
class ImportSurvey {
 public:
  /// @param valid [e] or empty; 0 = dead element
  explicit ImportSurvey(std::size_t elements, std::vector<std::uint8_t> valid = {});

  /// Takes the next rows, [k, e]; NaN: Unknown.
  void add(std::span<const double> pressure);

  std::size_t rows() const { return load_.size(); }
  std::size_t elements() const { return read_.size(); }
  /// [n] how far the most loaded living element reads above its least reading so far.
  const std::vector<float>& load() const { return load_; }
  /// [n] whether the array is pressed: at least half as much as in any row.
  std::vector<bool> pressed() const;
  /// [e] 1: has a reading, dead or not.
  const std::vector<std::uint8_t>& read() const { return read_; }
  /// The largest reading where all are whole numbers and some are large, as raw ones are.
  std::optional<double> whole_up_to() const;

 private:
  std::vector<std::uint8_t> valid_;
  std::vector<std::uint8_t> read_;
  std::vector<double> least_;
  std::vector<float> load_;
  bool whole_ = true;
  double largest_ = 0.0;
};

/// Columns and rows of `array` where it is a grid of more than one row; none of a file.
std::optional<std::array<std::size_t, 2>> grid_size(const ImportOptions& options);

/// Reads `array`, its elements in the order of their readings, as a grid or as a file, or takes the
/// elements of a program; checks `pressure-unit`.
/// @throws Error naming the option, or the file's line and column
ArrayTable import_array(const ImportOptions& options);

/// Marks as dead the elements without any reading. In touches, which have no unknown readings, it
/// also marks single readings.
/// @throws Error naming `path` where no element has any
void mark_unknown(const std::string& path, const ImportSurvey& survey, Recording& recording);

}  // namespace palpate
