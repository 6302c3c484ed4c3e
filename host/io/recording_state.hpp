#pragma once

#include <filesystem>

namespace palpate {

/// True where the HDF5 file is marked as open in a writer: while it is recorded, and after its
/// recorder was killed.
bool is_marked_open(const std::filesystem::path& path);

/// State of the recorder of a file that is_marked_open().
enum class Recorder { there, gone, unknown };

/// Returns whether the file's recorder runs; unknown where the file system has no locks.
Recorder recorder_of(const std::filesystem::path& path);

}  // namespace palpate
