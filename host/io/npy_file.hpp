#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace palpate {

/// True where the file begins as one that numpy.save wrote.
bool is_npy(const std::filesystem::path& path);

/// An array of numbers that numpy.save wrote.
struct NpyArray {
  std::vector<std::size_t> shape;
  std::vector<double> values;  ///< in C order: the last index varies fastest
};

/// Reads an array of little-endian float32, float64 or integers, stored in C or Fortran order.
/// @throws Error naming the file and what is wrong with its header or its size
NpyArray read_npy(const std::filesystem::path& path);

}  // namespace palpate
