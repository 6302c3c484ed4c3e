#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "recognition/batch/batch_task.hpp"
#include "recognition/recordings.hpp"

namespace palpate {

/// The recordings that the arguments stand for, in order and stamped: of a *.csv, those of its
/// rows, whose paths are relative to it; of a folder, its *.h5 by name, but for *.map.h5; of a
/// pattern such as 'touches/*.h5', those that match; of anything else, itself.
/// @throws Error (Fault::input) where a manifest or a folder cannot be read, where a manifest has
/// a column of another name than path, frames and label, and where there is no recording at all
std::vector<BatchEntry> list_inputs(std::span<const std::string> arguments);

/// A recording and its unknowns, which are views into it.
struct ReadInput {
  std::shared_ptr<const Recording> recording;
  std::vector<Query> unknowns;
};

/// Reads an input of a settled task: as many unknowns as the task counts, each with the error where
/// the input is at fault.
/// @param request completed
/// @throws Error where the file is not as it was when the task was settled, or the machine fails
ReadInput read_entry(const BatchTask& task, const BatchEntry& entry, const Request& request);

/// Surveys the inputs, where the request needs surveys, on so many threads; one that cannot be read
/// counts as one unknown without arrays. `progress` is called now and then by the calling thread.
void survey_inputs(std::span<BatchEntry> inputs, const Request& request, std::size_t threads,
                   const std::function<void(double)>& progress);

/// What follows from surveyed inputs. Without surveys, reads inputs until one can be read.
Circumstances infer(std::span<const BatchEntry> inputs, const Request& request);

}  // namespace palpate
