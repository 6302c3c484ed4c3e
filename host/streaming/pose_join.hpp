#pragma once

#include "io/pose_table.hpp"
#include "streaming/import_survey.hpp"
#include "streaming/table_import.hpp"

namespace palpate {

/// True where `poses` is the table of the pressures, under this or another path.
bool in_one_file(const ImportOptions& options);

/// Gives every row of the recording its pose, by time or row by row, and adds the finding "clock"
/// where presses and poses show it.
/// @throws Error where no row finds a pose
void join(PoseTable poses, const ImportSurvey& survey, const ImportOptions& options,
          ImportedRecording& imported);

}  // namespace palpate
