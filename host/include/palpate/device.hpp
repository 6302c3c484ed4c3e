#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

namespace gpu {
class Context;
}

/// What `palpate devices` shows of a Vulkan device.
struct DeviceInfo {
  int index = 0;
  std::string name;
  std::string type;    ///< "discrete", "integrated", "virtual", "CPU" or "other"
  std::string driver;  ///< name and version
  std::string api;     ///< Vulkan version, such as "1.3.230"
  double memory_gib = 0.0;
  bool usable = false;
  bool chosen = false;  ///< the one that Device::open() takes
  std::string reason;   ///< why it was chosen, or why it was not
};

/// A Vulkan device, opened for compute. Objects made on it must not outlive it. Not thread-safe:
/// use a device and what was made on it from one thread at a time. One that was moved from throws
/// Error whatever it is asked.
class Device {
 public:
  /// Every device, in Vulkan's order, with the reason for or against each one.
  static std::vector<DeviceInfo> list(std::string_view name_or_index = {});

  /// Opens a device: by index, by a part of its name (case ignored), or, given nothing, the one
  /// that PALPATE_DEVICE in the environment names in the same way, or else the best: discrete
  /// before integrated before virtual before CPU. With PALPATE_VALIDATION=1 in the environment,
  /// Vulkan's validation layer is on and any message it has becomes an Error.
  /// @throws Error where none fits, naming every device and why it was refused.
  static Device open(std::string_view name_or_index = {});

  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;
  ~Device();

  const std::string& name() const;
  /// Memory that it computes in, in bytes; a CPU device shares the machine's.
  std::uint64_t memory_bytes() const;
  gpu::Context& context();

 private:
  explicit Device(std::unique_ptr<gpu::Context> context);
  std::unique_ptr<gpu::Context> context_;
};

}  // namespace palpate
