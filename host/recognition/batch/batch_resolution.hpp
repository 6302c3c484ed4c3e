#pragma once

#include "recognition/batch/batch_task.hpp"
#include "recognition/recognition_job.hpp"

namespace palpate {

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
