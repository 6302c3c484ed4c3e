#pragma once

#include <hdf5.h>

#include <filesystem>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "io/watched_reading.hpp"

namespace palpate {

/// Locked for every use of HDF5 in this process.
inline std::mutex hdf5_mutex;

/// Locks HDF5 for this thread and silences HDF5's error printing while it lives.
class Hdf5Session {
 public:
  Hdf5Session() : lock_(hdf5_mutex) {
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Hdf5Session() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Hdf5Session(const Hdf5Session&) = delete;
  Hdf5Session& operator=(const Hdf5Session&) = delete;

 private:
  std::lock_guard<std::mutex> lock_;
  H5E_auto2_t print_ = nullptr;  ///< how the program wants HDF5's errors printed
  void* data_ = nullptr;
};

/// A session for a file of others': its filters must not load code, nor its links open other files,
/// which may be FIFOs. Links are refused where libhdf5 has to keep them for others.
class ConfinedSession {
 public:
  explicit ConfinedSession(const std::filesystem::path& path) : mark_(path) {
    H5PLget_loading_state(&plugins_);
    H5PLset_loading_state(0);
    if (is_reading_watched()) {
      H5Lunregister(H5L_TYPE_EXTERNAL);
    }
  }
  ~ConfinedSession() { H5PLset_loading_state(plugins_); }
  ConfinedSession(const ConfinedSession&) = delete;
  ConfinedSession& operator=(const ConfinedSession&) = delete;

 private:
  Hdf5Session session_;
  ReadingMark mark_;
  unsigned plugins_ = 0;
};

/// Owns an HDF5 identifier, which may be invalid.
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Hdf5Handle() {
    if (valid()) {
      close_(id_);
    }
  }
  Hdf5Handle(Hdf5Handle&& other) noexcept
      : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }

  hid_t get() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Returns HDF5's account of the last failure on this thread, the innermost error first.
inline std::vector<std::string> hdf5_errors() {
  std::vector<std::string> errors;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* all) -> herr_t {
        static_cast<std::vector<std::string>*>(all)->emplace_back(
            error->desc == nullptr ? "" : error->desc);
        return 0;
      },
      &errors);
  return errors;
}

}  // namespace palpate
