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

#include "io/forked_child.hpp"
#include "io/hdf5_process.hpp"
#include "io/hdf5_reader.hpp"
#include "io/input_file.hpp"

namespace palpate {

/// A forked child that reads one HDF5 file after the other, of each the same fields.
struct Hdf5Child {
  /// @param file_bytes most of a file; its disk has to deliver them at 1 MB/s
  /// @throws Error (Fault::system) where the system refuses another process
  Hdf5Child(const std::vector<std::string>& attributes, const std::vector<std::string>& datasets,
            std::uint64_t file_bytes);

  ForkedChild process;
  bool in_step = true;  ///< false while the child has to answer, and for ever where it fails
};

/// The named attributes and datasets that exist in an HDF5 file's root group.
///
/// What a file claims is checked before memory is taken for it. Numbers of datasets come in pieces,
/// so that no process holds more of them than it wants. No other file is opened: external links,
/// external storage and virtual datasets are refused.
///
/// A damaged file may all the same crash libhdf5 or make it loop. With read_hdf5_in_children(),
/// libhdf5 therefore reads in a forked child, which hands plain values back, so that no file takes
/// the program down; forking costs 2 ms, plus 25 ms for each GB that the process holds. Fork copies
/// the calling thread only: where such a program uses libhdf5 itself, none of its threads may be in
/// a libhdf5 call while an object of this class is made. Without a child, soft links are refused.
class Hdf5Contents {
 public:
  /// Takes a piece of a dataset's numbers in row-major order; `first` is the index of its first. A
  /// piece holds whole rows of the last axis, unless such a row has more than hdf5_piece numbers.
  /// Must not use HDF5.
  using Take = std::function<void(std::uint64_t first, std::span<const double> numbers)>;

  /// @param child that has been forked for these fields, is in step and reads no other file; none:
  /// a child of this object's own, where children read
  /// @throws Error where the file is missing, unreadable, no HDF5 file, truncated or damaged.
  Hdf5Contents(const std::filesystem::path& path, const std::vector<std::string>& attributes,
               const std::vector<std::string>& datasets, Hdf5Child* child = nullptr);

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
  void open_here(const std::vector<std::string>& attributes,
                 const std::vector<std::string>& datasets);
  void open_in_child();
  void read_here(const std::string& dataset, std::uint64_t rows, const Take& take);
  void read_from_child(const std::string& dataset, std::uint64_t rows, std::uint64_t total,
                       const Take& take);
  [[noreturn]] void refuse_damaged() const;
  const Hdf5Value& find(const std::map<std::string, Hdf5Value>& fields, const char* kind,
                        const std::string& name) const;

  std::filesystem::path path_;
  std::vector<std::string> dataset_names_;
  bool closed_ = true;
  std::map<std::string, Hdf5Value> attributes_;
  std::map<std::string, Hdf5Value> datasets_;
  // One of the two reads the file.
  Hdf5Child* child_;
  std::unique_ptr<Hdf5Reader> reader_;
  std::optional<Hdf5Child> own_child_;
};

}  // namespace palpate
