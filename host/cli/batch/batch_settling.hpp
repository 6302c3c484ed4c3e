#pragma once

#include <functional>
#include <optional>
#include <string>

#include "cli/batch/results_folder.hpp"
#include "recognition/batch/batch_task.hpp"
#include "recognition/recogniser.hpp"
#include "recognition/request.hpp"

namespace palpate::cli {

/// A batch whose task stands in its results folder.
struct SettledBatch {
  BatchTask task;
  RecognitionTask recognition;
  std::optional<Device> device;  ///< where settling needed it
};

/// Settles once for all shards what a results folder computes: by the task file that is there or,
/// where there is none, by writing it. Everything that follows from all inputs together, or from
/// the device at hand, is settled here, so that no chunk depends on who computes it.
/// @param now what is asked for: program, chunk_unknowns, each_frame, flags, and inputs without
/// stamps
/// @param request completed
/// @param open opens the device, where the bins follow from its memory
/// @param update whether results of another task may be dropped, as far as they differ
/// @throws Error (Fault::input) where the folder has results of another task
SettledBatch settle_batch(const ResultsFolder& folder, const FolderLock& lock, BatchTask now,
                          const Request& request, const std::function<Device()>& open, bool update,
                          std::size_t threads);

}  // namespace palpate::cli
