#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "evaluation.hpp"

namespace palpate::cli {

/// What files of results say about unknowns of known truth.
struct JudgedResults {
  std::vector<JudgedRecord> records;
  std::size_t without_truth = 0;  ///< records whose true label is not known
};

/// The files that the arguments stand for: an argument itself, or all *.json of a folder, by name.
/// @throws Error (Fault::input) for a folder without *.json, and for a file that is given twice
std::vector<std::filesystem::path> result_files(std::span<const std::string> arguments);

/// Reads the records of `palpate recognize --json`: an array of records, one record, or one record
/// a line.
/// @throws Error (Fault::input), in a line naming the file, the record (counted from 0) and the
/// field, where a file cannot be read, is not JSON or holds anything but records, where a value is
/// of the wrong type or out of range, and where a record's probabilities do not sum to 1 +- 0.01
JudgedResults read_results(std::span<const std::filesystem::path> files);

}  // namespace palpate::cli
