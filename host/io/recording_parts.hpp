#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

#include "palpate/touch.hpp"

namespace palpate {

/// Returns the pressures of one or more rows, [k, e], from this one on.
using PressureRows = std::function<std::vector<double>(std::size_t first)>;

/// Writes a recording of a constant array that holds no pressures: they come in parts.
/// @param narrow float32 holds the pressures
/// @throws Error as write_recording()
void write_recording_in_parts(const std::filesystem::path& path, const Recording& recording,
                              bool narrow, const PressureRows& rows);

}  // namespace palpate
