#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/pose_table.hpp"
#include "streaming/import_array.hpp"
#include "streaming/table_import.hpp"

namespace palpate {

/// True where `poses` is the table of the pressures, under this or another path.
bool in_one_file(const ImportOptions& options);

/// Lays the stretches between which the clock of tables steps back one behind another, with 10 s
/// between them: a stretch of the pressures and one of the poses belong together.
/// @returns what to say of them, in sentences that begin with file and line
/// @throws Error naming file and line where the two tables step back unlike often
std::vector<std::string> lay_out_stretches(const ImportOptions& options, PressureTable& pressures,
                                           std::optional<PoseTable>& poses);

/// Gives every row of the recording its pose, by time or row by row, and adds the finding "clock"
/// where presses and poses show it.
/// @throws Error where no row finds a pose
void join(PoseTable poses, const ImportSurvey& survey, const ImportOptions& options,
          ImportedRecording& imported);

}  // namespace palpate
