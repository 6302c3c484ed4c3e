#pragma once

#include <sys/stat.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "fake_usb_device.hpp"

namespace palpate {

/// Makes the process an ordinary user's while it lives, if the test is run by root.
class OrdinaryUser {
 public:
  explicit OrdinaryUser(const FakeUsb& usb) : was_root_(geteuid() == 0) {
    if (was_root_) {
      // umockdev's library makes and uses sockets there.
      chmod(usb.root().c_str(), 0777);
      chmod((usb.root() + "/ioctl/_default").c_str(), 0777);
      constexpr uid_t nobody = 65534;
      EXPECT_EQ(seteuid(nobody), 0);
    }
  }
  ~OrdinaryUser() {
    if (was_root_) {
      EXPECT_EQ(seteuid(0), 0);
    }
  }
  OrdinaryUser(const OrdinaryUser&) = delete;
  OrdinaryUser& operator=(const OrdinaryUser&) = delete;

 private:
  bool was_root_;
};

}  // namespace palpate
