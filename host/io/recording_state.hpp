#pragma once

#include <filesystem>

namespace palpate {

/// True where the HDF5 file says of itself that a writer has it open: while it is recorded, and
/// after its recorder was killed.
bool is_marked_open(const std::filesystem::path& path);

/// Tells other processes, as long as this one has the descriptor open, that the file is being
/// recorded, and keeps those that lock it from changing it. Does nothing where the file system has
/// no locks.
void mark_as_being_recorded(int descriptor);

/// What is known of a file that is_marked_open().
enum class Recorder { there, gone, unknown };

/// Whether the file's recorder is there; unknown where the file system has no locks.
Recorder recorder_of(const std::filesystem::path& path);

}  // namespace palpate
