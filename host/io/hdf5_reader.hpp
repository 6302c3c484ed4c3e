#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "io/hdf5_handle.hpp"
#include "io/hdf5_rows.hpp"

namespace palpate {

/// Value of an attribute (numbers or strings in row-major order), or shape of a dataset.
struct Hdf5Value {
  std::vector<std::uint64_t> shape;  ///< empty for a scalar
  std::vector<double> numbers;       ///< integers, floats and enumerations of any width
  std::vector<std::string> strings;  ///< of fixed or variable length
  std::string problem;               ///< why it cannot be read; "": it can
};

/// An open HDF5 file, those of the named attributes and datasets that its root group has, and the
/// rows of the datasets. Checks what a file claims before it allocates memory for it. Every call is
/// for one thread at a time that uses HDF5.
class Hdf5Reader {
 public:
  Hdf5Reader(const std::filesystem::path& path, std::uint64_t file_bytes,
             const std::vector<std::string>& attributes, const std::vector<std::string>& datasets,
             const Hdf5Confinement& confinement);

  const std::string& problem() const { return problem_; }  ///< why it cannot be opened; "": it can
  const std::map<std::string, Hdf5Value>& attributes() const { return attributes_; }
  /// Shapes and problems, without numbers.
  const std::map<std::string, Hdf5Value>& datasets() const { return datasets_; }

  /// Hdf5Rows::read() of a dataset in datasets().
  bool read(const std::string& dataset, std::uint64_t rows, const Hdf5Rows::Take& take);

 private:
  Hdf5Handle file_;
  std::string problem_;
  std::map<std::string, Hdf5Value> attributes_;
  std::map<std::string, Hdf5Value> datasets_;
  std::map<std::string, Hdf5Rows> rows_;
};

}  // namespace palpate
