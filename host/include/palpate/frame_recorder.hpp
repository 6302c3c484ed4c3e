#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "palpate/api.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Writes a stream of frames to a "palpate.recording" HDF5 file with `rows` = "frames". A kill, a
/// crash or a full disk loses at most the last second of the stream; a power cut also loses what
/// the operating system has not yet written to the disk.
///
/// The file appears with its first frames and grows about four times a second. It is readable at
/// any time, also after its recorder was killed (HDF5's SWMR, single writer and multiple readers):
/// with read_recording(), or with h5py's `h5py.File(path, "r", swmr=True)`. close_recording() turns
/// a file that was never closed into an ordinary one.
///
/// Pressures are stored as float32, finer than any sensor resolves, and as NaN where is_known() is
/// false. A pose or a device time that is not finite is stored as NaN (unknown). In the sensor's
/// name and serial number, '?' replaces what is not printable UTF-8.
class PALPATE_API FrameRecorder {
 public:
  /// @param path file to write; an older file stays until the first frames are saved
  /// @param sensor name, elements, unit, baseline and truth to store
  /// @throws Error (Fault::input) where the sensor's lists differ in length, its unit is neither
  /// "kPa" nor "raw", a label is not printable UTF-8, or an element, the baseline or the truth is
  /// not finite
  FrameRecorder(std::filesystem::path path, SensorDescription sensor);
  /// Closes the file and ignores errors; close() reports them.
  ~FrameRecorder();
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;

  /// Appends a frame. A frame that is not is_readable() is counted as lost instead: in lost(), and
  /// in the `lost_before` of the next frame in the file.
  /// @throws Error (Fault::input) on a frame of another size, (Fault::system) where the disk fails
  void add(const Frame& frame);
  /// Saves the frames added so far, for a stream that pauses. @throws Error (Fault::system)
  void flush();
  /// Saves the frames added so far and closes the file. @throws Error (Fault::system)
  void close();

  std::uint64_t frames() const;            ///< readable frames added
  std::uint64_t with_pose() const;         ///< frames() with a finite pose
  std::uint64_t lost() const;              ///< sum of `lost_before`, plus unreadable()
  std::uint64_t unreadable() const;        ///< frames that add() counted as lost
  std::uint64_t unknown_readings() const;  ///< total over frames()

 private:
  struct PALPATE_LOCAL Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
