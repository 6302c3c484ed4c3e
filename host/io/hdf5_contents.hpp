#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/hdf5_reader.hpp"
#include "io/input_file.hpp"

namespace palpate {

/// The named attributes and datasets that exist in an HDF5 file's root group.
///
/// What a file claims is checked before memory is taken for it. Numbers of datasets come in pieces,
/// so that the process holds no more of them than it wants. No other file is opened: external
/// links, external storage and virtual datasets are refused.
///
/// A damaged file may all the same crash libhdf5 or make it loop. A program that reads such files
/// has a process watch it, see watch_reading(); in another program, soft links are refused too.
class Hdf5Contents {
 public:
  /// Takes a piece of a dataset's numbers in row-major order; `first` is the index of its first. A
  /// piece holds whole rows of the last axis, unless such a row has more than hdf5_piece numbers.
  /// Must not use HDF5.
  using Take = std::function<void(std::uint64_t first, std::span<const double> numbers)>;

  /// @throws Error where the file is missing, unreadable, no HDF5 file, truncated or damaged.
  Hdf5Contents(const std::filesystem::path& path, const std::vector<std::string>& attributes,
               const std::vector<std::string>& datasets);

  /// False for a file that is being recorded or whose recorder was killed: see FrameRecorder.
  bool closed() const { return closed_; }
  bool has_attribute(const std::string& name) const { return attributes_.contains(name); }
  bool has_dataset(const std::string& name) const { return datasets_.contains(name); }

  ~Hdf5Contents();
  Hdf5Contents(const Hdf5Contents&) = delete;
  Hdf5Contents& operator=(const Hdf5Contents&) = delete;

  // The functions below throw Error, naming file and field, on a missing field or another type.
  std::string text(const std::string& attribute) const;
  std::vector<std::string> texts(const std::string& attribute) const;
  double number(const std::string& attribute) const;
  std::vector<double> numbers(const std::string& attribute, std::size_t count) const;
  /// A whole number from `least` to the largest int.
  int integer(const std::string& attribute, int least) const;
  /// Returns the shape of a dataset of numbers; throws Error where it has not `rank` dimensions.
  const std::vector<std::uint64_t>& shape(const std::string& dataset,
                                          std::optional<std::size_t> rank = {}) const;
  /// Reads the dataset's first rows, or all.
  void read(const std::string& dataset, const Take& take, std::uint64_t rows = UINT64_MAX);

  /// Throws Error, "<path>: <message>"; see palpate::refuse().
  template <typename... Parts>
  [[noreturn]] void refuse(fmt::format_string<const Parts&...> message,
                           const Parts&... parts) const {
    palpate::refuse(path_, message, parts...);
  }

 private:
  const Hdf5Value& find(const std::map<std::string, Hdf5Value>& fields, const char* kind,
                        const std::string& name) const;

  std::filesystem::path path_;
  bool closed_ = true;
  std::map<std::string, Hdf5Value> attributes_;
  std::map<std::string, Hdf5Value> datasets_;
  std::unique_ptr<Hdf5Reader> reader_;
};

}  // namespace palpate
