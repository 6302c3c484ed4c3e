#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "palpate/device.hpp"

namespace palpate::cli {

/// One of `count` parts of the chunks of a results folder: chunk k belongs to shard k mod count.
struct Shard {
  std::size_t index = 0;
  std::size_t count = 1;
};

/// Most shards of a results folder.
inline constexpr std::size_t most_shards = 1'000'000;

/// The number in a variable that Slurm sets; none where it is not set.
/// @throws Error (Fault::input) where it holds no whole number
std::optional<std::size_t> slurm_number(const char* variable);

/// The shard of a flag's "I/N" or, where it is "", that of a Slurm task: one of a job array, whose
/// number Slurm tells by SLURM_ARRAY_TASK_ID, _MIN, _STEP and _COUNT, one of the tasks that srun
/// started (SLURM_PROCID of SLURM_STEP_NUM_TASKS), or both. Otherwise the whole.
/// @throws Error (Fault::input) on anything else than 0 <= I < N, and on an array whose task
/// numbers are not evenly spaced
Shard shard_of(const std::string& flag);

/// The device, as an index or a name, that a process takes which is the `rank`-th on its computer:
/// of several usable devices with the name of the one that is chosen, each process takes another
/// in turn. `wished` where there is only one, or where it is an index.
/// @param devices Device::list(wished)
std::string local_device(std::span<const DeviceInfo> devices, const std::string& wished,
                         std::size_t rank);

}  // namespace palpate::cli
