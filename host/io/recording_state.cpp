#include "io/recording_state.hpp"

#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include "io/file_format.hpp"
#include "io/hdf5_handle.hpp"
#include "io/hdf5_writer.hpp"
#include "io/input_file.hpp"
#include "io/recording_survey.hpp"
#include "io/watched_reading.hpp"
#include "model/descriptor.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate {

bool is_marked_open(const std::filesystem::path& path) {
  // Layout of the superblock in HDF5's file format specification: signature, version, two sizes
  // and, from version 2 on, the flags of its writers.
  constexpr char signature[] = {'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
  constexpr std::size_t version = 8;
  constexpr std::size_t flags = 11;
  char bytes[flags + 1] = {};
  const Descriptor file(path, O_RDONLY);
  return file.valid() && ::pread(file.get(), bytes, sizeof bytes, 0) == sizeof bytes &&
         std::memcmp(bytes, signature, sizeof signature) == 0 && bytes[version] >= 2 &&
         bytes[flags] != 0;
}

Recorder recorder_of(const std::filesystem::path& path) {
  const Descriptor file(path, O_RDONLY);
  if (file.valid() && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0) {
    return Recorder::gone;
  }
  return file.valid() && errno == EWOULDBLOCK ? Recorder::there : Recorder::unknown;
}

namespace {

// Cuts every growing dataset to the complete rows.
bool cut_rows(hid_t file, std::uint64_t rows) {
  for (const char* name : row_names) {
    if (H5Lexists(file, name, H5P_DEFAULT) <= 0) {
      continue;
    }
    const Hdf5Handle dataset(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
    const Hdf5Handle space(dataset.valid() ? H5Dget_space(dataset.get()) : -1, H5Sclose);
    hsize_t extents[H5S_MAX_RANK] = {};
    if (!space.valid() || H5Sget_simple_extent_dims(space.get(), extents, nullptr) < 1) {
      return false;
    }
    if (extents[0] > rows) {
      extents[0] = rows;
      if (H5Dset_extent(dataset.get(), extents) < 0) {
        return false;
      }
    }
  }
  return true;
}

// Works as h5clear does, with the same HDF5 properties: opens the file in spite of its marks, takes
// its end from its size, and closes it. The file is opened as by a recorder, so that it stays
// readable whenever this process is killed.
bool close_file(const std::filesystem::path& path, std::uint64_t rows) {
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  set_appendable(access.get());
  H5Pset_file_locking(access.get(), false, true);  // the caller holds the lock
  hbool_t yes = 1;
  if (H5Pset(access.get(), "clear_status_flags", &yes) < 0 ||
      H5Pset(access.get(), "skip_eof_check", &yes) < 0) {
    return false;
  }
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR | H5F_ACC_SWMR_WRITE, access.get());
  const bool done = file >= 0 && H5Fincrement_filesize(file, 0) >= 0 && cut_rows(file, rows) &&
                    H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0;
  return done && H5Fclose(file) >= 0;
}

Descriptor lock(const std::filesystem::path& path) {
  Descriptor file(path, O_RDWR);
  if (!file.valid()) {
    refuse(path, "cannot be closed: {}; check its permissions", std::strerror(errno));
  }
  if (::flock(file.get(), LOCK_EX | LOCK_NB) == 0) {
    return file;
  }
  refuse(path, "cannot be closed: {}",
         errno == EWOULDBLOCK
             ? "another program has it open, which may be recording it; wait until "
               "it is done"
             : "its file system has no locks, which tell whether it is being "
               "recorded; copy it to another disk first");
}

}  // namespace

bool close_recording(const std::filesystem::path& path) {
  // The whole file is read first, so that nothing changes in a damaged or foreign file.
  const RecordingHead before = survey_recording(path).head;
  if (before.recording.closed) {
    return false;
  }
  std::string reason;
  {
    const Descriptor locked = lock(path);
    if (!is_marked_open(path)) {
      return false;
    }
    const Hdf5Session session;
    const ReadingMark mark(path);
    reason = close_file(path, before.rows) ? "" : hdf5_failure();
  }
  if (reason.empty()) {
    const RecordingHead after = survey_recording(path).head;
    if (!after.recording.closed || after.rows != before.rows) {
      reason = fmt::format("it has {} of {} rows", after.rows, before.rows);
    }
  }
  if (!reason.empty()) {
    throw Error(Fault::system,
                fmt::format("{}: cannot be closed: {}; free or repair the disk and try again",
                            path.string(), reason));
  }
  return true;
}

}  // namespace palpate
