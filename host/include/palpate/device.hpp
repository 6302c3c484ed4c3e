#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "palpate/api.hpp"

namespace palpate {

namespace gpu {
class Context;
}

struct VulkanDevice;

/// A Vulkan device as `palpate devices` lists it.
struct DeviceInfo {
  int index = 0;
  std::string name;
  std::string type;    ///< "discrete", "integrated", "virtual", "CPU" or "other"
  std::string driver;  ///< name and version
  std::string api;     ///< Vulkan version, such as "1.3.230"
  double memory_gib = 0.0;
  bool usable = false;
  bool chosen = false;  ///< Device::open() takes this device
  std::string reason;   ///< why the device is chosen or refused
};

/// An open Vulkan device for compute. It must outlive every object made on it. Every call on a
/// moved-from device throws Error, and so does every use of a device, and of the objects on it, in
/// a child of fork().
///
/// Threads: several objects on one device may be used, made and destroyed at the same time, each by
/// one thread at a time; their commands take turns on the device's queue. Only moving or destroying
/// the device itself needs every other use to have ended.
class PALPATE_API Device {
 public:
  /// Lists every device in Vulkan's order and marks the one that open(name_or_index) would take.
  /// @throws Error where Vulkan or every driver is missing
  static std::vector<DeviceInfo> list(std::string_view name_or_index = {});

  /// Opens a device by its index or by a part of its name (case ignored). An empty `name_or_index`
  /// stands for the environment variable PALPATE_DEVICE. Without both, the best device is opened:
  /// discrete before integrated before virtual before CPU. With PALPATE_VALIDATION=1 in the
  /// environment, Vulkan's validation layer is on and each of its messages becomes an Error.
  /// @throws Error where no device fits, whose message names every device and why it is refused,
  /// and where Vulkan is missing, whose message names the Debian packages to install
  static Device open(std::string_view name_or_index = {});

  /// Computes on a device that the program has made itself (palpate/vulkan_device.hpp). The program
  /// keeps the handles, which must outlive the Device; Palpate submits commands to the queue, waits
  /// for these alone, and neither waits for nor destroys anything else.
  /// @throws Error on a null handle, an older Vulkan, or a queue family that does not compute
  static Device share(const VulkanDevice& device);

  const std::string& name() const;  ///< as Vulkan reports it
  /// Size of the memory in which the device computes, in bytes; a CPU device shares the machine's.
  std::uint64_t memory_bytes() const;
  PALPATE_LOCAL gpu::Context& context();  ///< for the library's own classes

 private:
  PALPATE_LOCAL explicit Device(gpu::Context* context);
  std::unique_ptr<gpu::Context, void (*)(gpu::Context*)> context_{nullptr, nullptr};
};

}  // namespace palpate
