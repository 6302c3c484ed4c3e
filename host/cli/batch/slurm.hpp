#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "palpate/device.hpp"

namespace palpate::cli {

/// The number in a variable that Slurm sets; none where it is not set.
/// @throws Error (Fault::input) where it holds no whole number
std::optional<std::size_t> slurm_number(const char* variable);

/// The device, as an index or a name, that a process takes which is the `rank`-th on its computer:
/// of several usable devices with the name of the one that is chosen, each process takes another
/// in turn. `wished` where there is only one, or where it is an index.
/// @param devices Device::list(wished)
std::string local_device(std::span<const DeviceInfo> devices, const std::string& wished,
                         std::size_t rank);

}  // namespace palpate::cli
