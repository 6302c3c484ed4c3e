#include "cli/batch/slurm.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "cli/options.hpp"

namespace palpate::cli {

std::optional<std::size_t> slurm_number(const char* variable) {
  const char* const text = std::getenv(variable);
  if (text == nullptr || *text == '\0') {
    return {};
  }
  std::size_t number = 0;
  const char* const end = text + std::string_view(text).size();
  const auto [rest, error] = std::from_chars(text, end, number);
  if (error != std::errc{} || rest != end) {
    refuse_flag(variable, text, "is no whole number; unset it, or give --shard I/N");
  }
  return number;
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
