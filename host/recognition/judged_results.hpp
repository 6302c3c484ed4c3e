#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "recognition/evaluation.hpp"

namespace palpate {

/// What files of results say about unknowns of known truth.
struct JudgedResults {
  std::vector<JudgedRecord> records;
  std::size_t without_truth = 0;  ///< records whose true label is not known
  std::size_t failed = 0;         ///< records of palpate batch that hold an error
};

/// The files that the arguments stand for: an argument itself, the chunks of a folder of palpate
/// batch, or all *.json of another folder, by name.
/// @throws Error (Fault::input) for a folder without such files, and for a file that is given twice
std::vector<std::filesystem::path> result_files(std::span<const std::string> arguments);

/// Reads the records of `palpate recognize --json` or `palpate batch`: an array of records, one
/// record, or one record a line. Records that hold an error are counted, and no more.
/// @throws Error (Fault::input), in a line naming the file, the record (counted from 0) and the
/// field, where a file cannot be read, is not JSON or holds anything but records, where a value is
/// of the wrong type or out of range, and where a record's probabilities do not sum to 1 +- 0.01
JudgedResults read_results(std::span<const std::filesystem::path> files);
/// The records of one such file as they stand in it, and the plans between those of `live`. Fields
/// that are shown have their type, or are missing or null: recording, error, touches, unknown,
/// touch, mode.map, mode.mirrored, fit.verdict and decision.act.
/// @throws Error as read_results()
std::vector<nlohmann::json> records_in(const std::filesystem::path& file);
/// Adds the records of such a file's text.
/// @param file names the text in messages
/// @throws Error as read_results()
void add_records(const std::filesystem::path& file, const std::string& text,
                 JudgedResults& results);

/// Compares the records with the truth.
/// @param source of the results, for the message
/// @throws Error (Fault::input) where no record has a true label
Evaluation evaluate(const JudgedResults& results, const std::filesystem::path& source);

}  // namespace palpate
