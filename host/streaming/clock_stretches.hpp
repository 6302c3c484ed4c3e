#pragma once

#include <optional>
#include <string>
#include <vector>

#include "streaming/table_import.hpp"

namespace palpate {

/// Lays the stretches between which the clock of tables steps back one behind another, with 10 s
/// between them: a stretch of the pressures and one of the poses belong together.
/// @returns what to say of them, in sentences that begin with file and line
/// @throws Error naming file and line where the two tables step back unlike often
std::vector<std::string> lay_out_stretches(const ImportOptions& options, PressureTable& pressures,
                                           std::optional<PoseTable>& poses);

}  // namespace palpate
