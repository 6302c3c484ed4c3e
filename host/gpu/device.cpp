#include "palpate/device.hpp"

#include <utility>

#include "gpu/context.hpp"
#include "gpu/selection.hpp"

namespace palpate {

std::vector<DeviceInfo> Device::list(std::string_view name_or_index) {
  gpu::Instance instance;
  std::vector<DeviceInfo> infos;
  for (gpu::Candidate& candidate : gpu::candidates(instance.handle(), gpu::wished(name_or_index))) {
    infos.push_back(std::move(candidate.info));
  }
  return infos;
}

Device Device::open(std::string_view name_or_index) {
  return Device(std::make_unique<gpu::Context>(name_or_index));
}

Device Device::share(const VulkanDevice& device) {
  return Device(std::make_unique<gpu::Context>(device));
}

Device::Device(std::unique_ptr<gpu::Context> context) : context_(std::move(context)) {}
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&& other) noexcept {
  replace_held(context_, std::move(other.context_));
  return *this;
}
Device::~Device() { replace_held(context_); }

const std::string& Device::name() const { return held_by(context_, "device").name(); }
std::uint64_t Device::memory_bytes() const { return held_by(context_, "device").limits().memory; }
gpu::Context& Device::context() { return held_here(context_, "device"); }

}  // namespace palpate
