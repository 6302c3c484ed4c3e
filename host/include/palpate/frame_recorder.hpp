#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "palpate/sensor.hpp"

namespace palpate {

/// Writes a stream of frames to a "palpate.recording" HDF5 file with `rows` = "frames", such that a
/// kill, a crash or a full disk at any moment costs at most the last second of it.
///
/// The file appears with the first frames in it and is appended to about four times a second, so
/// that readers find whole rows at any time (HDF5's SWMR, single writer and multiple readers).
/// read_recording() opens it while it is written and when it was never closed; h5py does with
/// `h5py.File(path, "r", swmr=True)`. close_recording() turns a file that was never closed into a
/// usual one.
///
/// A pose or a device time that is not finite is stored as unknown; a name or a serial number that
/// is not printable UTF-8 is stored with '?' in it. Pressures are stored as float32, finer than any
/// sensor resolves, and NaN where a reading is Unknown: see is_known(). A power cut may cost what
/// the system has not yet brought to the disk.
class FrameRecorder {
 public:
  /// @param path the recording to be made; an older file stays until the first frames are saved
  /// @param sensor names the sensor and gives its elements, unit, baseline and truth
  /// @throws Error (Fault::input) where the sensor's lists disagree, or hold what no recording may:
  /// a unit other than kPa and raw, labels that are not printable UTF-8, elements, baselines or a
  /// truth that are not finite
  FrameRecorder(std::filesystem::path path, SensorDescription sensor);
  /// Closes the file as far as that succeeds.
  ~FrameRecorder();
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;

  /// Keeps a place in the file for a baseline that is known only later; a file that is cut off
  /// before has none. To be called before the first frame is added.
  void expect_baseline();
  /// Stores the baseline, [e]. @throws Error (Fault::input) on another size, or where frames are
  /// saved already and the file keeps no place for it; the recorder can be used on. Throws Error
  /// (Fault::system) where the disk is full
  void set_baseline(std::vector<double> baseline);

  /// Appends a frame. A frame that is not is_readable() counts as lost instead: with the next frame
  /// in the file, and in lost() even where no frame follows.
  /// @throws Error (Fault::input) on a frame of another size, (Fault::system) where the disk is
  /// full
  void add(const Frame& frame);
  /// Saves what was added: when no frame comes for a while. @throws Error (Fault::system)
  void flush();
  /// Saves what was added and closes the file. @throws Error (Fault::system)
  void close();

  std::uint64_t frames() const;            ///< added so far
  std::uint64_t with_pose() const;         ///< of them, with a pose that is finite
  std::uint64_t lost() const;              ///< lost so far, as the frames say, and unreadable()
  std::uint64_t unreadable() const;        ///< given to add() so far, and counted as lost
  std::uint64_t unknown_readings() const;  ///< of frames(), see unknown_readings()

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
