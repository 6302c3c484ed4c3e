#pragma once

#include <span>
#include <string>

namespace palpate::bench {

struct KernelOptions {
  std::string device;  ///< a device's name or index; empty for the best
  std::string json;    ///< file to write; empty for none
  bool quick = false;  ///< small sizes, a few repeats
};

/// Measures every case, prints the table and writes the JSON document.
/// @throws Error where the device or the file cannot be opened
void measure_kernels(const KernelOptions& options, std::span<char* const> command_line);

}  // namespace palpate::bench
