#include "cli/batch/shard.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "cli/options.hpp"

namespace palpate::cli {

namespace {

std::optional<std::size_t> count_in(std::string_view text) {
  std::size_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  return error == std::errc{} && rest == end ? std::optional(number) : std::nullopt;
}

/// That of a job array's task; the whole outside of one.
Shard shard_of_array() {
  const auto id = slurm_number("SLURM_ARRAY_TASK_ID");
  const auto count = slurm_number("SLURM_ARRAY_TASK_COUNT");
  if (!id || !count) {
    return {};
  }
  const std::size_t first = slurm_number("SLURM_ARRAY_TASK_MIN").value_or(0);
  const std::size_t step = slurm_number("SLURM_ARRAY_TASK_STEP").value_or(1);
  const bool even = step > 0 && *id >= first && (*id - first) % step == 0;
  const std::size_t index = even ? (*id - first) / step : *count;
  if (index >= *count || *count > most_shards) {
    refuse_flag("SLURM_ARRAY_TASK_ID", *id,
                "is not one of {} evenly spaced numbers from {}; submit with --array=0-{}, or give "
                "--shard I/N",
                *count, first, *count - 1);
  }
  return {index, *count};
}

}  // namespace

std::optional<std::size_t> slurm_number(const char* variable) {
  const char* const text = std::getenv(variable);
  if (text == nullptr || *text == '\0') {
    return {};
  }
  const auto number = count_in(text);
  if (!number) {
    refuse_flag(variable, text, "is no whole number; unset it, or give --shard I/N");
  }
  return number;
}

Shard shard_of(const std::string& flag) {
  if (!flag.empty()) {
    const std::string_view text = flag;
    const std::size_t slash = text.find('/');
    const auto index = count_in(text.substr(0, slash));
    const auto count = slash == text.npos ? std::nullopt : count_in(text.substr(slash + 1));
    if (!index || !count || *index >= *count || *count > most_shards) {
      refuse_flag("--shard", flag, "give it as I/N, with I from 0 to N - 1 and N up to {}",
                  most_shards);
    }
    return {*index, *count};
  }
  const Shard array = shard_of_array();
  // Not SLURM_NTASKS, which a batch script has outside of its steps, too.
  const std::size_t tasks = slurm_number("SLURM_STEP_NUM_TASKS").value_or(1);
  const std::size_t task = slurm_number("SLURM_PROCID").value_or(0);
  if (task >= tasks || tasks > most_shards / array.count) {
    refuse_flag("SLURM_PROCID", task,
                "of {} tasks is no shard among up to {}; unset it, or give --shard I/N", tasks,
                most_shards);
  }
  return {array.index * tasks + task, array.count * tasks};
}

std::string local_device(std::span<const DeviceInfo> devices, const std::string& wished,
                         std::size_t rank) {
  const auto chosen = std::ranges::find_if(devices, &DeviceInfo::chosen);
  const bool index =
      !wished.empty() && std::ranges::all_of(wished, [](char c) { return c >= '0' && c <= '9'; });
  if (chosen == devices.end() || index) {
    return wished;
  }
  std::vector<int> alike;
  for (const DeviceInfo& device : devices) {
    if (device.usable && device.name == chosen->name) {
      alike.push_back(device.index);
    }
  }
  return alike.size() > 1 ? std::to_string(alike[rank % alike.size()]) : wished;
}

}  // namespace palpate::cli
