// Tests that the fake is as strict as a kernel: a file that was opened before the device was
// unplugged must stay dead.
#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include <gtest/gtest.h>

#include "fake_takktile.hpp"

namespace palpate::fake_usb_device_test {

/// A device file that a program has open.
class OpenedFile {
 public:
  explicit OpenedFile(const FakeUsbDevice& device) : file_(open(device.node().c_str(), O_RDWR)) {
    EXPECT_GE(file_, 0) << device.node();
  }
  ~OpenedFile() { close(file_); }
  OpenedFile(const OpenedFile&) = delete;
  OpenedFile& operator=(const OpenedFile&) = delete;

  /// The errno of the call; 0 if the call succeeds.
  template <class Argument>
  int answer(unsigned long request, Argument* argument) const {
    return ioctl(file_, request, argument) == 0 ? 0 : errno;
  }

  int claim() const {
    unsigned interface = 0;
    return answer(USBDEVFS_CLAIMINTERFACE, &interface);
  }
  int submit(usbdevfs_urb& urb) const { return answer(USBDEVFS_SUBMITURB, &urb); }
  int reap(usbdevfs_urb*& urb) const { return answer(USBDEVFS_REAPURBNDELAY, &urb); }

 private:
  int file_;
};

/// A transfer from the bulk endpoint into `bytes`.
usbdevfs_urb bulk_read(std::array<std::uint8_t, 64>& bytes) {
  usbdevfs_urb urb{};
  urb.type = USBDEVFS_URB_TYPE_BULK;
  urb.endpoint = 0x81;
  urb.buffer = bytes.data();
  urb.buffer_length = static_cast<int>(bytes.size());
  return urb;
}

void expect_dead(const OpenedFile& file) {
  std::uint32_t capabilities = 0;
  EXPECT_EQ(file.answer(USBDEVFS_GET_CAPABILITIES, &capabilities), ENODEV);
  EXPECT_EQ(file.claim(), ENODEV);
  unsigned number = 0;
  EXPECT_EQ(file.answer(USBDEVFS_RELEASEINTERFACE, &number), ENODEV);
  number = 0x81;
  EXPECT_EQ(file.answer(USBDEVFS_CLEAR_HALT, &number), ENODEV);
  std::array<std::uint8_t, 64> bytes = {};
  usbdevfs_urb urb = bulk_read(bytes);
  EXPECT_EQ(file.submit(urb), ENODEV);
  EXPECT_EQ(file.answer(USBDEVFS_DISCARDURB, &urb), ENODEV);
  usbdevfs_urb* none = nullptr;
  EXPECT_EQ(file.reap(none), ENODEV);
}

class FakeUsbDeviceFile : public testing::Test {
 protected:
  FakeUsb usb_;
  FakeTakktile board_{usb_, "1", {0b11111}};
};

TEST_F(FakeUsbDeviceFile, IsDeadForEverOnceTheDeviceIsUnplugged) {
  const OpenedFile never_used(board_.usb());
  const OpenedFile file(board_.usb());
  std::array<std::uint8_t, 64> bytes = {};
  usbdevfs_urb urb = bulk_read(bytes);
  EXPECT_EQ(file.claim(), 0);
  EXPECT_EQ(file.submit(urb), 0);
  usbdevfs_urb* reaped = nullptr;
  EXPECT_EQ(file.reap(reaped), EAGAIN);

  board_.usb().unplug();
  ASSERT_EQ(file.reap(reaped), 0) << "what was under way can still be reaped";
  EXPECT_EQ(reaped, &urb);
  EXPECT_EQ(urb.status, -ESHUTDOWN);
  expect_dead(file);
  expect_dead(never_used);

  // At another address, and after all others had their turn at the old address.
  for (const int by : {1, 0}) {
    const std::string before = board_.usb().node();
    board_.usb().plug(by);
    EXPECT_EQ(board_.usb().node() == before, by == 0);
    board_.send_frame(100);
    expect_dead(file);
    expect_dead(never_used);
    EXPECT_EQ(board_.usb().waiting_packets(), 1U) << "the packet is for whoever opens it anew";
    const OpenedFile anew(board_.usb());
    EXPECT_EQ(anew.claim(), 0);
    EXPECT_EQ(anew.submit(urb), 0);
    EXPECT_EQ(anew.reap(reaped), 0);
    EXPECT_EQ(urb.status, 0);
    board_.usb().unplug();
    expect_dead(anew);
  }
}

TEST_F(FakeUsbDeviceFile, HoldsItsInterfacesAgainstOthers) {
  const OpenedFile one(board_.usb());
  const OpenedFile other(board_.usb());
  EXPECT_EQ(one.claim(), 0);
  EXPECT_EQ(one.claim(), 0) << "it has it already";
  EXPECT_EQ(other.claim(), EBUSY);
}

}  // namespace palpate::fake_usb_device_test
