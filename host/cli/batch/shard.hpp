#pragma once

#include <cstddef>
#include <string>

namespace palpate::cli {

/// One of `count` parts of the chunks of a results folder: chunk k belongs to shard k mod count.
struct Shard {
  std::size_t index = 0;
  std::size_t count = 1;

  bool owns(std::size_t chunk) const { return chunk % count == index; }
};

/// Most shards of a results folder.
inline constexpr std::size_t most_shards = 1'000'000;

/// The shard of a flag's "I/N" or, where it is "", that of a Slurm task: one of a job array, whose
/// number Slurm tells by SLURM_ARRAY_TASK_ID, _MIN, _STEP and _COUNT, one of the tasks that srun
/// started (SLURM_PROCID of SLURM_STEP_NUM_TASKS), or both. Otherwise the whole.
/// @throws Error (Fault::input) on anything else than 0 <= I < N, and on an array whose task
/// numbers are not evenly spaced
Shard shard_of(const std::string& flag);

}  // namespace palpate::cli
