#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "io/hdf5_handle.hpp"
#include "io/input_file.hpp"

namespace palpate {

/// Most numbers in one piece of a dataset.
inline constexpr std::uint64_t hdf5_piece = 1 << 17;

/// The bytes of values of this shape and width; UINT64_MAX on overflow.
std::uint64_t stored_bytes(std::span<const std::uint64_t> shape, std::uint64_t width);

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
  /// Takes a piece of a dataset's numbers in row-major order; `first` counts the numbers that were
  /// read before it. A piece holds whole rows of the last axis, unless such a row has more than
  /// hdf5_piece numbers. Must not use HDF5.
  using Take = std::function<void(std::uint64_t first, std::span<const double> numbers)>;

  /// @throws Error where the file is missing, unreadable, no HDF5 file, truncated or damaged.
  Hdf5Contents(const std::filesystem::path& path, const std::vector<std::string>& attributes,
               const std::vector<std::string>& datasets);
  ~Hdf5Contents();
  Hdf5Contents(const Hdf5Contents&) = delete;
  Hdf5Contents& operator=(const Hdf5Contents&) = delete;

  /// False for a file that is being recorded or whose recorder was killed: see FrameRecorder.
  bool closed() const { return closed_; }
  bool has_attribute(const std::string& name) const { return attributes_.contains(name); }
  bool has_dataset(const std::string& name) const { return datasets_.contains(name); }

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
  /// How many numbers `rows` rows from `first_row` on hold; rows behind the last do not count.
  std::uint64_t size(const std::string& dataset, std::uint64_t first_row = 0,
                     std::uint64_t rows = UINT64_MAX) const;
  /// Reads the numbers of these rows in pieces.
  void read(const std::string& dataset, const Take& take, std::uint64_t first_row = 0,
            std::uint64_t rows = UINT64_MAX) const;
  /// Returns the values of these rows, each of one number or of as many doubles as it holds.
  template <typename Value>
  std::vector<Value> read(const std::string& dataset, std::uint64_t first_row = 0,
                          std::uint64_t rows = UINT64_MAX) const {
    std::size_t width = 1;
    if constexpr (!std::is_arithmetic_v<Value>) {
      width = sizeof(Value) / sizeof(double);
    }
    std::vector<Value> all;
    all.reserve(size(dataset, first_row, rows) / width);
    const auto take = [&](std::uint64_t, std::span<const double> some) {
      if constexpr (std::is_arithmetic_v<Value>) {
        all.insert(all.end(), some.begin(), some.end());
      } else {
        const std::size_t before = all.size();
        all.resize(before + some.size() / width);
        std::memcpy(static_cast<void*>(&all[before]), some.data(), some.size_bytes());
      }
    };
    read(dataset, take, first_row, rows);
    return all;
  }

  /// Throws Error, "<path>: <message>"; see palpate::refuse().
  template <typename... Parts>
  [[noreturn]] void refuse(fmt::format_string<const Parts&...> message,
                           const Parts&... parts) const {
    palpate::refuse(path_, message, parts...);
  }

 private:
  struct Field {
    std::vector<std::uint64_t> shape;  ///< empty for a scalar
    std::string fault;                 ///< why it cannot be read; "": it can
  };
  /// Integers, floats and enumerations of any width, or texts of fixed or variable length.
  struct Attribute : Field {
    std::vector<double> numbers;
    std::vector<std::string> texts;
  };
  struct Dataset : Field {
    Hdf5Handle handle{H5I_INVALID_HID, H5Dclose};
    std::uint64_t band_bytes = 0;  ///< of the chunks that a pass over the rows holds at once
  };

  void open_fields(const std::vector<std::string>& attributes,
                   const std::vector<std::string>& datasets);
  void close();
  // Return the field's fault; "" where it can be read.
  static std::string read_attribute(hid_t attribute, std::uint64_t file_bytes, Attribute& value);
  std::string open(const std::string& name, std::uint64_t file_bytes, Dataset& dataset) const;
  std::string reopen_with_cache(const std::string& name, hid_t creation, std::size_t width,
                                Dataset& dataset) const;
  template <typename Named>
  const Named& find(const std::map<std::string, Named>& fields, const char* kind,
                    const std::string& name) const {
    const auto found = fields.find(name);
    if (found == fields.end()) {
      refuse("{} '{}' is missing; add it", kind, name);
    }
    if (!found->second.fault.empty()) {
      refuse("{} '{}' {}", kind, name, found->second.fault);
    }
    return found->second;
  }

  std::filesystem::path path_;
  bool closed_ = true;
  Hdf5Handle file_{H5I_INVALID_HID, H5Fclose};
  std::map<std::string, Attribute> attributes_;
  std::map<std::string, Dataset> datasets_;
};

}  // namespace palpate
