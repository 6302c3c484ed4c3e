#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hdf5_handle.hpp"

namespace palpate {

/// An HDF5 file that is put together in memory and saved in one piece: a disk that refuses is met
/// by AtomicFile, not in the middle of HDF5's caches. The same content gives the same bytes.
/// Every function throws Error (Fault::system) where HDF5 or the disk refuses.
class Hdf5Writer {
 public:
  using Shape = std::vector<std::size_t>;
  enum class Storage { plain, compressed };

  /// @param path where save() puts it; the target is not touched before.
  explicit Hdf5Writer(std::filesystem::path path);
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  void attribute(const char* name, std::string_view text);
  void attribute(const char* name, std::span<const std::string> texts);
  void attribute(const char* name, double number);
  void attribute(const char* name, int number);
  void attribute(const char* name, const std::vector<double>& numbers);

  void dataset(const char* name, const Shape& shape, std::span<const double> values,
               Storage storage = Storage::plain);
  void dataset(const char* name, const Shape& shape, std::span<const float> values);
  void dataset(const char* name, const Shape& shape, std::span<const std::uint8_t> values);

  void save();

 private:
  void add_attribute(const char* name, hid_t type, hid_t space, const void* values);
  void add_dataset(const char* name, const Shape& shape, hid_t type, const void* values,
                   Storage storage);
  void require(bool done, std::string_view what) const;

  std::filesystem::path path_;
  std::lock_guard<std::mutex> lock_;
  H5E_auto2_t print_ = nullptr;  ///< how the program wants HDF5's errors printed
  void* print_data_ = nullptr;
  Hdf5Handle file_;
};

}  // namespace palpate
