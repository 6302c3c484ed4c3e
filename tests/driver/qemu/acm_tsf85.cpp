// Plays a Robotiq TSF-85 (driver/profiles/tsf85.yaml) at the far end of a CDC serial gadget:
//
//   acm_tsf85 TTY
//
// Sends frames of two fingers with the period that the start command asks for, until the command
// comes again with a period of 0.

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <thread>
#include <vector>

namespace {

constexpr std::uint8_t preamble = 0x9A;
constexpr std::uint8_t send_by_itself = 0x58;
constexpr int taxels = 28;

/// A packet with the pressures of one finger; its checksum is 0, as the polynomial is not public.
std::vector<std::uint8_t> packet(int finger, std::uint64_t frame) {
  std::vector<std::uint8_t> bytes = {preamble, 0, send_by_itself, 1 + 2 * taxels,
                                     static_cast<std::uint8_t>(0x10 | finger << 2)};
  for (int i = 0; i < taxels; ++i) {
    const std::uint64_t value = (frame + i) & 0xFFFF;
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  return bytes;
}

bool send(int port, const std::vector<std::uint8_t>& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t n = write(port, bytes.data() + sent, bytes.size() - sent);
    if (n <= 0) {
      return false;
    }
    sent += static_cast<std::size_t>(n);
  }
  return true;
}

/// The period, in ms, of a start or stop command among the received bytes, or -1.
int read_command(int port, std::vector<std::uint8_t>& received) {
  std::uint8_t buffer[64];
  const ssize_t n = read(port, buffer, sizeof(buffer));
  if (n > 0) {
    received.insert(received.end(), buffer, buffer + n);
  }
  int period = -1;
  while (received.size() >= 5) {
    if (received[0] == preamble && received[2] == send_by_itself && received[3] == 1) {
      period = received[4];
      received.erase(received.begin(), received.begin() + 5);
    } else {
      received.erase(received.begin());
    }
  }
  return period;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: acm_tsf85 TTY\n");
    return 2;
  }
  const int port = open(argv[1], O_RDWR | O_NOCTTY);
  termios line{};
  if (port < 0 || tcgetattr(port, &line) != 0) {
    std::perror(argv[1]);
    return 1;
  }
  cfmakeraw(&line);
  tcsetattr(port, TCSANOW, &line);

  int period_ms = 0;
  std::uint64_t frame = 0;
  std::vector<std::uint8_t> received;
  auto next = std::chrono::steady_clock::now();
  while (true) {
    pollfd readable{port, POLLIN, 0};
    if (poll(&readable, 1, period_ms == 0 ? 100 : 0) > 0) {
      const int asked = read_command(port, received);
      if (asked >= 0) {
        period_ms = asked;
        next = std::chrono::steady_clock::now();
      }
    }
    if (period_ms == 0) {
      continue;
    }
    if (!send(port, packet(0, frame)) || !send(port, packet(1, frame))) {
      std::perror("write");
      return 1;
    }
    ++frame;
    next += std::chrono::milliseconds(period_ms);
    std::this_thread::sleep_until(next);
  }
}
