#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recognition/recognition_job.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// Size and time of modification, by which a changed file is noticed.
struct FileStamp {
  std::uintmax_t bytes = 0;
  std::int64_t modified_ns = 0;  ///< since the Unix epoch

  friend bool operator==(const FileStamp&, const FileStamp&) = default;
};
/// None where there is no such file.
std::optional<FileStamp> stamp_of(const std::string& path);

/// What is known of an input from reading it ahead of its recognition.
struct InputSurvey {
  std::size_t touches = 1;    ///< that are used; 1 where it cannot be read
  double reach_mm = 0.0;      ///< the largest array_reach_mm() of its touches
  std::string pressure_unit;  ///< "" where it cannot be read
};

/// A recording of a batch, as its manifest or the caller names it.
struct BatchEntry {
  std::string path;
  std::optional<Frames> frames = {};  ///< of the manifest; none: as the request says
  std::string label = {};             ///< of the manifest: the true label; "": the recording's own
  std::optional<FileStamp> stamp = {};
  std::optional<InputSurvey> survey = {};  ///< only where the task needs it
};

/// What a results folder computes: the content of its task file, in whose absence nothing is
/// computed. Two equal tasks have equal results.
struct BatchTask {
  std::string program;                       ///< version
  std::size_t chunk_unknowns = 0;            ///< in each chunk but the last
  Request request;                           ///< as asked; its device does not count
  std::map<std::string, std::string> files;  ///< maps, sensor model, scene: hashes of their content
  Circumstances inferred;  ///< from all inputs together; its source is the first that can be read
  std::array<int, 3> bins{};  ///< of the lattice; those of --bins auto follow from the device
  std::vector<BatchEntry> inputs;

  std::size_t unknowns_of(const BatchEntry& entry) const;
  std::size_t unknowns() const;
  std::size_t chunks() const;
};

// The lines of a task file: its head, which is the task without its inputs, and a line for each of
// the inputs.
std::string head_text(const BatchTask& task);
std::string entry_text(const BatchEntry& entry);
/// What head_text() and entry_text() have written.
BatchTask head_from(std::string_view text);
BatchEntry entry_from(std::string_view text);

/// Reads and writes the task file. @throws Error, also for a task of more than 1e9 unknowns
BatchTask read_batch_task(const std::filesystem::path& file);
/// Returns false, and leaves the file as it is, where there is one by then.
bool write_batch_task(const std::filesystem::path& file, const BatchTask& task);

/// Why all results of `before` are no results of `now`, naming the option or the file; "" where
/// only inputs may differ.
std::string difference_of_tasks(const BatchTask& before, const BatchTask& now);
/// The first input that differs, in words; "" where none does.
std::string difference_of_inputs(const BatchTask& before, const BatchTask& now);

// How a batch's request becomes a task, once, before anyone recognises a part of it: everything
// that follows from all inputs together, or from the device at hand, so that no record depends on
// who computes it. Requests are completed.

/// Refuses budget_ms, whose results depend on the clock. @throws Error
void refuse_budget(const Request& request);

/// Puts the hashes of the files that the recognition depends on into the task. @throws Error
void hash_files(BatchTask& task, const Request& request);

/// The recognition that a task with its inference asks for, on the task's bins. Where the task has
/// none yet, settles them and puts them there.
/// @param device see RecognitionJob
/// @throws Error
RecognitionJob job_of(BatchTask& task, const Request& request, DeviceSource device = {});

}  // namespace palpate
