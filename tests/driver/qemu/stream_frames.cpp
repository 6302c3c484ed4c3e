// Streams frames from a board and reports them:
//
//   stream_frames BOARD SECONDS
//   stream_frames --check FILE LEAST_FRAMES RECONNECTS    # of a run's output

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>

#include "palpate/driver.hpp"
#include "palpate/error.hpp"

namespace {

int check(const std::string& file, std::uint64_t least_frames, std::uint64_t reconnects) {
  std::ifstream input(file);
  std::string word;
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;
  std::uint64_t reconnected = 0;
  if (!(input >> word >> frames >> word >> lost >> word >> reconnected)) {
    std::cout << file << ": holds no counts\n";
    return 1;
  }
  // Frames in transfer when the board was unplugged may be lost.
  const bool whole = lost == 0 || reconnects > 0;
  return frames >= least_frames && whole && reconnected == reconnects ? 0 : 1;
}

int stream(const std::string& board, double seconds) {
  const auto sensor = palpate::open_board(board);
  sensor->start();
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  std::uint64_t frames = 0;
  while (std::chrono::steady_clock::now() < end) {
    frames += sensor->next(std::chrono::milliseconds(100)) ? 1 : 0;
  }
  sensor->stop();
  const palpate::SensorCounters counters = sensor->counters();
  std::cout << "frames " << frames << " lost " << counters.lost << " reconnects "
            << counters.reconnects << " stalls " << counters.stalls << " timeouts "
            << counters.timeouts << " garbage " << counters.garbage_bytes << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 5 && std::string(argv[1]) == "--check") {
      return check(argv[2], std::stoull(argv[3]), std::stoull(argv[4]));
    }
    if (argc == 3) {
      return stream(argv[1], std::stod(argv[2]));
    }
    std::cerr << "usage: stream_frames BOARD SECONDS\n";
    return 2;
  } catch (const palpate::Error& error) {
    std::cout << error.what() << "\n";
    return 1;
  }
}
