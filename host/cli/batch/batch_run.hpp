#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "cli/results_folder.hpp"
#include "recognition/batch/batch_task.hpp"
#include "recognition/recognition_job.hpp"

namespace palpate::cli {

/// Unknowns of a run so far.
struct BatchCounts {
  std::size_t done = 0;
  std::size_t failed = 0;
};

/// A run that computes some chunks of a results folder.
struct BatchRun {
  const ResultsFolder& folder;
  const BatchTask& task;
  const RecognitionJob& job;        ///< settled
  const std::vector<bool>& wanted;  ///< [chunk]
  std::size_t to_be_done = 0;       ///< unknowns of these chunks
  std::size_t threads = 1;
  bool verbose = false;
};

/// Recognises the unknowns of the wanted chunks and writes each chunk once it is whole. Recordings
/// are read while others are recognised, so that memory does not follow their number. Bounds
/// recognise several unknowns at once, and so do histograms of so few bins that a device would wait
/// for the host; larger ones and particles, whose work a device divides by itself, one. The chunks
/// have the same bytes whatever the number of threads. Calls `progress` now and then.
/// @throws Error where an input changes meanwhile, and on a full disk or a device that fails
BatchCounts run_batch(const BatchRun& run, const std::function<void(const BatchCounts&)>& progress);

}  // namespace palpate::cli
