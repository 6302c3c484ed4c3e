#pragma once

#include "palpate/device.hpp"

namespace palpate {

/// The device of all tests of a program that ask for no other: to open one takes longer than most
/// of them. It lives to the program's end, beyond the loader's own objects.
inline Device& shared_device() {
  static Device* const device = new Device(Device::open());
  return *device;
}

}  // namespace palpate
