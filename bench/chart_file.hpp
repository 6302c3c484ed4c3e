#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "chart.hpp"

namespace palpate::bench {

/// NAME.png and NAME.svg, the files of a chart.
std::array<std::string, 2> chart_files(const std::string& name);
/// Writes the chart into the folder as NAME.png and NAME.svg.
/// @throws Error where the disk refuses
void write_chart(const Chart& chart, const std::filesystem::path& folder, const std::string& name);

}  // namespace palpate::bench
