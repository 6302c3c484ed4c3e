#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/text_table.hpp"
#include "recognition/evaluation.hpp"

namespace palpate::cli {

/// The scores, the reliability bins that have records, a line for each class with what it was taken
/// for, unknown classes and pose errors.
/// @param without_truth number of records that were left out
std::string evaluation_text(const Evaluation& evaluation, std::size_t without_truth);

/// Adds what scores say of some records: accuracy and its interval, log-loss, calibration error.
/// @param columns of the table after the first; null: an empty cell
void add_score_rows(TextTable& table, const std::vector<const Scores*>& columns);

}  // namespace palpate::cli
