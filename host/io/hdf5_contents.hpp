#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forked_child.hpp"

namespace palpate {

/// The value of one attribute, numbers or strings, in row-major order; or a dataset's shape.
struct Hdf5Value {
  std::vector<std::uint64_t> shape;  ///< empty for a scalar
  std::vector<double> numbers;       ///< integers, floats and enumerations of any width
  std::vector<std::string> strings;  ///< of fixed or variable length
  std::string problem;               ///< why it could not be read; empty: it could
};

/// Named attributes and datasets of an HDF5 file's root group, those of them that are there.
///
/// libhdf5 is not safe against damaged files: with one bit flipped in a file's first pages, version
/// 1.10.8 crashed on one in 100 and looped without end on one in 400. It therefore reads in a
/// forked child, which hands plain values back, so that no file can take the program down. A read
/// costs about 2 ms, and 25 ms more for each GB that the process holds. Numbers of datasets come in
/// pieces, so that neither process holds more of them than it wants. Nothing but this one file is
/// opened: external links, external storage and virtual datasets are refused.
///
/// Fork copies the calling thread only: a program that uses libhdf5 itself must not be in a call of
/// it, on another thread, while an object of this class is made.
class Hdf5Contents {
 public:
  /// Takes numbers of a dataset as they come, in row-major order: the place of the first of them
  /// and some of them.
  using Take = std::function<void(std::uint64_t first, std::span<const double> numbers)>;

  /// @throws Error where the file is missing, unreadable, no HDF5 file, truncated or damaged.
  Hdf5Contents(const std::filesystem::path& path, const std::vector<std::string>& attributes,
               const std::vector<std::string>& datasets);

  /// False for a file that is being written or whose writer was killed: see FrameRecorder.
  bool closed() const { return closed_; }
  bool has_attribute(const std::string& name) const { return attributes_.contains(name); }
  bool has_dataset(const std::string& name) const { return datasets_.contains(name); }

  // These throw Error, naming the file and the field, where it is missing or not of this kind.
  std::string text(const std::string& attribute) const;
  std::vector<std::string> texts(const std::string& attribute) const;
  double number(const std::string& attribute) const;
  std::vector<double> numbers(const std::string& attribute, std::size_t count) const;
  /// A whole number from `least` to the largest int.
  int integer(const std::string& attribute, int least) const;
  /// The shape of a dataset of numbers with this many dimensions, or any number of them.
  const std::vector<std::uint64_t>& shape(const std::string& dataset,
                                          std::optional<std::size_t> rank = {}) const;
  /// How many numbers a dataset holds; the largest number where it claims more than can be said.
  std::uint64_t count(const std::string& dataset) const;
  /// Reads the dataset's first rows, or all.
  void read(const std::string& dataset, const Take& take, std::uint64_t rows = UINT64_MAX);

  /// Throws Error, "<path>: <message>".
  [[noreturn]] void refuse(std::string_view message) const;

 private:
  struct Dataset {
    std::uint64_t index;
    Hdf5Value value;
  };

  void receive(const std::vector<std::string>& datasets);
  [[noreturn]] void refuse_damaged() const;
  const Hdf5Value& attribute(const std::string& name) const;
  const Dataset& dataset(const std::string& name) const;

  std::filesystem::path path_;
  bool closed_ = true;
  std::map<std::string, Hdf5Value> attributes_;
  std::map<std::string, Dataset> datasets_;
  std::optional<ForkedChild> child_;
};

}  // namespace palpate
