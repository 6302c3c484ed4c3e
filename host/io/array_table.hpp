#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <glm/vec2.hpp>

namespace palpate {

/// The elements of an array.
struct ArrayTable {
  std::vector<glm::dvec2> elements_mm;  ///< [e] centres in the sensor frame
  std::vector<std::uint8_t> valid;      ///< [e] or empty; 0 = dead element
  std::vector<double> baseline;         ///< [e] or empty: untouched readings
};

/// Reads an array from a CSV file with a row for each element and the columns x and y (in mm, or in
/// m where they are called x_m and y_m) and, where they are known, valid and baseline. A table
/// without a header holds x and y.
/// @throws Error naming file, line and column
ArrayTable read_array(const std::filesystem::path& path);

}  // namespace palpate
