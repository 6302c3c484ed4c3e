#pragma once

#include <cstddef>
#include <functional>

#include "cli/batch/batch_task.hpp"
#include "cli/batch/input_reading.hpp"
#include "cli/recognition_flags.hpp"
#include "recognition/recogniser.hpp"

namespace palpate::cli {

// What a batch settles once, before anyone recognises a part of it: everything that follows from
// all inputs together, or from the device at hand, so that no record depends on who computes it.

/// Refuses --budget-ms, whose results depend on the clock. @throws Error
void refuse_budget(const RecognitionFlags& flags);

/// Stamps the inputs.
void stamp_inputs(BatchTask& task);

/// Reads the inputs that lack a survey, where the task needs surveys; see survey_inputs().
void survey(BatchTask& task, const RecognitionFlags& flags, const InputRules& rules,
            std::size_t threads, const std::function<void(double)>& progress);

/// The recognition that a task with its inference asks for. Puts the hashes of the files that it
/// depends on into the task. @throws Error
RecognitionTask recognition_of(BatchTask& task, const RecognitionFlags& flags,
                               const InputRules& rules);

/// Settles the bins by the device, the filter and the evidence, and puts the bins into the task.
/// @param device needed where recognition.bin_width is set
/// @throws Error
void settle_recognition(BatchTask& task, RecognitionTask& recognition,
                        const RecognitionFlags& flags, const InputRules& rules,
                        const Device* device);

/// The same with the bins that the task has been settled with.
void settle_as_before(const BatchTask& task, RecognitionTask& recognition);

/// Whether the filter computes on a device. Bounds do not.
bool uses_device(const RecognitionTask& recognition);

/// Has bounds take so many host threads.
void take_threads(RecognitionTask& recognition, std::size_t threads);

/// Opens the filter. @param device may be null where uses_device() is false
Recogniser open_batch_filter(Device* device, const RecognitionTask& recognition);

}  // namespace palpate::cli
