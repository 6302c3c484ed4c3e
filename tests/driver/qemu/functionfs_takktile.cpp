// Plays a TakkTile by Linux's FunctionFS: answers the vendor requests and streams frames as a real
// board does, on a kernel with a gadget controller such as dummy_hcd.
//
//   functionfs_takktile FOLDER FRAMES_PER_SECOND
//
// FOLDER is a mounted functionfs. Prints "ready" once the descriptors are written, and the number
// of sent frames when a stream ends.

#include <endian.h>
#include <fcntl.h>
#include <linux/usb/functionfs.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr int rows = 8;
constexpr int columns = 5;  // all 40 cells alive: 160 bytes a frame, whose last packet is short

struct __attribute__((packed)) Descriptors {
  usb_functionfs_descs_head_v2 head;
  __le32 full_speed_count;
  usb_interface_descriptor interface;
  usb_endpoint_descriptor_no_audio in;
  usb_endpoint_descriptor_no_audio out;
};

struct __attribute__((packed)) Strings {
  usb_functionfs_strings_head head;
  __le16 language;
  char name[9];
};

usb_endpoint_descriptor_no_audio bulk_endpoint(std::uint8_t address) {
  usb_endpoint_descriptor_no_audio endpoint{};
  endpoint.bLength = sizeof(endpoint);
  endpoint.bDescriptorType = USB_DT_ENDPOINT;
  endpoint.bEndpointAddress = address;
  endpoint.bmAttributes = USB_ENDPOINT_XFER_BULK;
  endpoint.wMaxPacketSize = htole16(64);
  return endpoint;
}

[[noreturn]] void fail(const std::string& what) {
  std::perror(what.c_str());
  std::exit(1);
}

int open_endpoint(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR);
  if (file < 0) {
    fail(path);
  }
  return file;
}

void describe(int control) {
  Descriptors descriptors{};
  descriptors.head.magic = htole32(FUNCTIONFS_DESCRIPTORS_MAGIC_V2);
  descriptors.head.length = htole32(sizeof(descriptors));
  // Vendor requests go to the device, not to the interface.
  descriptors.head.flags = htole32(FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_ALL_CTRL_RECIP);
  descriptors.full_speed_count = htole32(3);
  descriptors.interface.bLength = sizeof(descriptors.interface);
  descriptors.interface.bDescriptorType = USB_DT_INTERFACE;
  descriptors.interface.bNumEndpoints = 2;
  descriptors.interface.bInterfaceClass = USB_CLASS_VENDOR_SPEC;
  descriptors.interface.iInterface = 1;
  descriptors.in = bulk_endpoint(USB_DIR_IN | 1);
  descriptors.out = bulk_endpoint(USB_DIR_OUT | 2);
  if (write(control, &descriptors, sizeof(descriptors)) != sizeof(descriptors)) {
    fail("descriptors");
  }
  Strings strings{};
  strings.head.magic = htole32(FUNCTIONFS_STRINGS_MAGIC);
  strings.head.length = htole32(sizeof(strings));
  strings.head.str_count = htole32(1);
  strings.head.lang_count = htole32(1);
  strings.language = htole16(0x0409);
  std::snprintf(strings.name, sizeof(strings.name), "TakkTile");
  if (write(control, &strings, sizeof(strings)) != sizeof(strings)) {
    fail("strings");
  }
}

/// Sends frames from a thread of its own while the host asks for them.
class Stream {
 public:
  Stream(std::string folder, int rate) : folder_(std::move(folder)), rate_(rate) {}

  void start() {
    stop();
    join();
    running_ = true;
    thread_ = std::thread([this] { send(); });
  }

  /// Does not wait for the thread: its write blocks until the host reads the frame or is gone.
  void stop() { running_ = false; }

  void join() {
    if (thread_.joinable()) {
      thread_.join();
    }
  }

 private:
  void send() {
    const int in = open((folder_ + "/ep1").c_str(), O_RDWR);
    if (in < 0) {
      std::perror("ep1");  // unplugged between the request and now
      return;
    }
    std::vector<std::uint8_t> frame(std::size_t{rows} * columns * 4);
    sent_ = 0;
    auto next = std::chrono::steady_clock::now();
    while (running_) {
      // Every cell of frame n holds n modulo 1000, left-aligned in ten bits, at one temperature.
      const std::uint64_t value = sent_ % 1000;
      for (std::size_t cell = 0; cell < frame.size(); cell += 4) {
        frame[cell] = static_cast<std::uint8_t>(value >> 2);
        frame[cell + 1] = static_cast<std::uint8_t>(value << 6);
        frame[cell + 2] = 0x80;
        frame[cell + 3] = 0x00;
      }
      if (write(in, frame.data(), frame.size()) != static_cast<ssize_t>(frame.size())) {
        break;  // disconnected
      }
      ++sent_;
      next += std::chrono::nanoseconds(1'000'000'000 / rate_);
      std::this_thread::sleep_until(next);
    }
    close(in);
    std::printf("sent %llu\n", static_cast<unsigned long long>(sent_));
    std::fflush(stdout);
  }

  std::string folder_;
  int rate_;
  std::atomic<bool> running_ = false;
  std::uint64_t sent_ = 0;
  std::thread thread_;
};

std::vector<std::uint8_t> reply_to(const usb_ctrlrequest& request) {
  switch (request.bRequest) {
    case 0x00: {
      const std::string text = le16toh(request.wIndex) == 0 ? "gadget" : "1.0";
      return {text.begin(), text.end()};
    }
    case 0x5C:
      return std::vector<std::uint8_t>(rows, (1 << columns) - 1);
    case 0x6C:
      // The worked example of the MPL115A2's data sheet: a0 = 2009.75, b1 = -2.375854,
      // b2 = -0.920471, c12 = 0.000790.
      return {0x3E, 0xCE, 0xB3, 0xF9, 0xC5, 0x17, 0x33, 0xC8};
    case 0xC7:
    case 0xBA:
      return {1};
    default:
      return {};
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: functionfs_takktile FOLDER FRAMES_PER_SECOND\n");
    return 2;
  }
  const std::string folder = argv[1];
  const int control = open_endpoint(folder + "/ep0");
  describe(control);
  std::printf("ready\n");
  std::fflush(stdout);

  Stream stream(folder, std::atoi(argv[2]));
  usb_functionfs_event event;
  while (true) {
    if (read(control, &event, sizeof(event)) != sizeof(event)) {
      if (errno == EIDRM || errno == EINTR) {
        continue;  // the host gave up this request and sent the next
      }
      std::perror("ep0");
      return 1;
    }
    if (event.type == FUNCTIONFS_DISABLE || event.type == FUNCTIONFS_UNBIND) {
      stream.stop();
      stream.join();
    }
    if (event.type != FUNCTIONFS_SETUP) {
      continue;
    }
    const usb_ctrlrequest& request = event.u.setup;
    std::vector<std::uint8_t> reply = reply_to(request);
    if ((request.bRequestType & USB_DIR_IN) == 0 || reply.empty()) {
      // Access in the wrong direction stalls the endpoint.
      char none = 0;
      if ((request.bRequestType & USB_DIR_IN) != 0) {
        (void)!read(control, &none, 0);
      } else {
        (void)!write(control, &none, 0);
      }
      continue;
    }
    const auto length = std::min<std::size_t>(reply.size(), le16toh(request.wLength));
    if (write(control, reply.data(), length) < 0) {
      std::perror("reply");
    }
    if (request.bRequest == 0xC7) {
      if (request.wIndex != 0) {
        stream.start();
      } else {
        stream.stop();
      }
    }
  }
}
