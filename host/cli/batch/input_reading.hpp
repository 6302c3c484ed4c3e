#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/batch/batch_task.hpp"
#include "cli/unknowns.hpp"
#include "io/recording_reader.hpp"
#include "palpate/scene.hpp"

namespace palpate::cli {

/// How inputs become unknowns.
struct InputRules {
  UnknownFlags flags;
  std::optional<Frames> frames;  ///< of the flags
  Scene scene;
  std::string scene_file;
};

/// A recording and its unknowns, which are views into it.
struct ReadInput {
  std::shared_ptr<const Recording> recording;
  std::vector<Unknown> unknowns;
};

/// Reads an input.
/// @param inferred whose pressure unit the recording must have; none: any unit will do
/// @throws Error (Fault::input) where the recording is at fault
ReadInput read_input(RecordingReader& reader, const BatchInput& input, const InputRules& rules,
                     const BatchInference* inferred);

/// Reads an input of a settled task: as many unknowns as the task counts, each with the error where
/// the input is at fault.
/// @throws Error where the file is not as it was when the task was settled, or the machine fails
ReadInput read_entry(RecordingReader& reader, const BatchTask& task, const BatchEntry& entry,
                     const InputRules& rules);

/// Reads the inputs that lack a survey, on so many threads; one that cannot be read counts as one
/// unknown without arrays. `progress` is called now and then by the calling thread.
void survey_inputs(std::span<BatchEntry> inputs, const InputRules& rules, std::size_t threads,
                   const std::function<void(double)>& progress);

/// What follows from surveyed inputs. Without surveys, reads inputs until one can be read.
BatchInference infer(std::span<const BatchEntry> inputs, const InputRules& rules);

}  // namespace palpate::cli
