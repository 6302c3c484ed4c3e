#pragma once

// Vulkan's functions for the code of this folder: volk's pointers, under names of Palpate's own, so
// that a program may link the archive beside libvulkan or beside a volk of its own. The headers of
// this folder show types alone.
#include "renamed_volk.hpp"

namespace palpate::gpu {

/// Loads Vulkan's loader at its first call: the library that PALPATE_VULKAN_LIBRARY names in the
/// environment, or libvulkan.so.1. Every function of Vulkan may be called afterwards, by any
/// thread.
/// @throws Error (Fault::system) where it is missing; a later call tries again
void load_vulkan();

/// vkCreateInstance(). The drivers and layers that the loader loads for the instance then stay in
/// the process; it would unload them with the last instance. Loading a driver takes long, and
/// NVIDIA's uses up something of the process each time: after some 25 times no instance could be
/// created. What other threads load meanwhile stays, too.
VkResult create_instance(const VkInstanceCreateInfo& info, VkInstance& instance);

}  // namespace palpate::gpu
