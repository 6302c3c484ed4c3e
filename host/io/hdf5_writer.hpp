#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <hdf5.h>
#include <glm/vec2.hpp>

#include "io/hdf5_handle.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Sets a file access property list up for `appendable` files: see Hdf5Writer::Layout.
void set_appendable(hid_t access);

/// The bytes of an HDF5 file made in memory. H5Fget_file_image() would not do: HDF5 1.10 spoils a
/// checksum in the image of a file with SWMR.
struct FreeHdf5Bytes {
  void operator()(char* bytes) const { H5free_memory(bytes); }
};
using Hdf5Bytes = std::unique_ptr<char, FreeHdf5Bytes>;

/// Builds an HDF5 file in memory and saves it in one piece, so that a failing disk is met by
/// AtomicFile, not in the middle of HDF5's caches. The same content gives the same bytes. Every
/// function throws Error (Fault::system) where HDF5 or the disk fails.
class Hdf5Writer {
 public:
  using Shape = std::vector<std::size_t>;
  /// Storage of a dataset; a `narrow` one holds float32, and a `growing` one can be extended along
  /// the first axis.
  enum class Storage { plain, narrow, compressed, growing };
  /// What HDF5 can do with the file after save(): an `appendable` one can be open in one writer and
  /// many readers at a time (SWMR), which takes HDF5 1.10.
  enum class Layout { closed, appendable };

  /// @param path target of save(), which is not touched before
  /// @param expected_bytes of the file, if known: they are taken at once, as growth may copy them
  explicit Hdf5Writer(std::filesystem::path path, Layout layout = Layout::closed,
                      std::size_t expected_bytes = 0);
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  void attribute(const char* name, std::string_view text);
  void attribute(const char* name, std::span<const std::string> texts);
  void attribute(const char* name, double number);
  void attribute(const char* name, int number);
  void attribute(const char* name, const std::vector<double>& numbers);

  /// Poses take three numbers each, points two.
  template <typename Value>
  void dataset(const char* name, const Shape& shape, const std::vector<Value>& values,
               Storage storage = Storage::plain) {
    add_dataset(name, shape, native_type(Value{}), values.data(), storage);
  }
  /// Writes a dataset in parts, in order: `part` returns one or more steps along the first axis,
  /// from the one that it is given on.
  void dataset(const char* name, const Shape& shape,
               const std::function<std::vector<double>(std::size_t)>& part, Storage storage);

  /// Writes the file; no call may follow.
  /// @param finished called with the whole file before it appears under its name, and may keep it
  /// open; where it throws, the file never appears
  void save(const std::function<void(const std::filesystem::path&)>& finished = {});

 private:
  static hid_t native_type(double) { return H5T_NATIVE_DOUBLE; }
  static hid_t native_type(const glm::dvec2&) { return H5T_NATIVE_DOUBLE; }
  static hid_t native_type(const Pose&) { return H5T_NATIVE_DOUBLE; }
  static hid_t native_type(float) { return H5T_NATIVE_FLOAT; }
  static hid_t native_type(std::int32_t) { return H5T_NATIVE_INT32; }
  static hid_t native_type(std::uint8_t) { return H5T_NATIVE_UINT8; }
  static hid_t native_type(std::uint64_t) { return H5T_NATIVE_UINT64; }

  void add_attribute(const char* name, hid_t type, hid_t space, const void* values);
  void add_dataset(const char* name, const Shape& shape, hid_t type, const void* values,
                   Storage storage);
  /// A dataset without values.
  Hdf5Handle create_dataset(const char* name, const Shape& shape, hid_t type, Storage storage);
  void require(bool done, std::string_view what) const;

  std::filesystem::path path_;
  Hdf5Session session_;
  Hdf5Bytes bytes_;  ///< once the file is closed
  Hdf5Handle file_;  ///< until save()
};

/// Returns why HDF5's last call on this thread failed, in the words of the operating system, such
/// as "No space left on device"; "HDF5 failed" where the system was not the cause.
std::string hdf5_failure();

/// Gives up a file that could not be written: it stays as if the program had been killed now, and
/// H5Fclose() succeeds. Without this, HDF5 1.10 crashes at exit where a file has unsaved parts.
void give_up_hdf5_file(hid_t file);

}  // namespace palpate
