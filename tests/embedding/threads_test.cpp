// What the headers allow several threads to do at the same time; the preset `threads` runs these
// tests with ThreadSanitizer.
#include <unistd.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "letters.hpp"

namespace palpate::threads_test {

constexpr int threads = 4;

/// Calls `work(i)` on thread i, all at the same time.
void on_threads(const std::function<void(int)>& work) {
  std::atomic<int> ready = 0;
  std::vector<std::thread> running;
  for (int i = 0; i < threads; ++i) {
    running.emplace_back([&, i] {
      ++ready;
      while (ready < threads) {
      }
      work(i);
    });
  }
  for (std::thread& thread : running) {
    thread.join();
  }
}

std::vector<double> histogram_after(Device& device, const std::vector<Hypothesis>& maps,
                                    const Recording& unknown, std::size_t first) {
  PoseHistogram belief(device, maps, {.lattice = small_lattice()});
  for (std::size_t i = first; i < unknown.size(); ++i) {
    belief.update(unknown.touch(i));
    belief.estimate();
  }
  return belief.log_likelihood(1);
}

class Threads : public testing::Test {
 protected:
  Device device_ = Device::open();
  std::vector<Hypothesis> maps_ = letter_maps(device_);
  Recording unknown_ = unknown_letter(6);
};

TEST_F(Threads, ShareADeviceWithTheResultsOfOneThread) {
  std::vector<std::vector<double>> alone;
  for (int i = 0; i < threads; ++i) {
    alone.push_back(histogram_after(device_, maps_, unknown_, i));
  }
  std::vector<std::vector<double>> together(threads);
  on_threads([&](int i) { together[i] = histogram_after(device_, maps_, unknown_, i); });
  for (int i = 0; i < threads; ++i) {
    EXPECT_EQ(together[i], alone[i]) << "thread " << i;
  }
}

TEST_F(Threads, MakeDifferentEstimatorsOnADevice) {
  const auto particles_after = [&] {
    ParticleFilter filter(device_, maps_, {.particles = 500, .seed = 7});
    filter.update(unknown_.touches(0, unknown_.size()));
    return filter.estimate().identity;
  };
  const std::vector<double> particles = particles_after();
  const std::vector<double> bins = histogram_after(device_, maps_, unknown_, 0);
  on_threads([&](int i) {
    switch (i) {
      case 0:
        EXPECT_EQ(particles_after(), particles);
        break;
      case 1:
        EXPECT_EQ(histogram_after(device_, maps_, unknown_, 0), bins);
        break;
      default:
        EXPECT_EQ(letter_maps(device_)[1].map.log_odds, maps_[1].map.log_odds);
    }
  });
}

// Planning divides the candidates among threads of its own.
TEST_F(Threads, PlanTouchesOnADevice) {
  const std::vector<Pose> candidates = random_poses(20, /*seed=*/4);
  const std::vector<glm::dvec2> elements_mm = digitacts_array();
  const auto gains_after = [&](std::size_t touches) {
    PoseHistogram belief(device_, maps_, {.lattice = small_lattice()});
    belief.update(unknown_.touches(0, touches));
    std::vector<double> gains;
    for (const TouchGain& gain :
         belief.expected_gain(candidates, elements_mm, {.samples = 32, .seed = 5})) {
      gains.push_back(gain.both());
    }
    return gains;
  };
  const std::array alone{gains_after(1), gains_after(2)};
  on_threads([&](int i) { EXPECT_EQ(gains_after(1 + i % 2), alone[i % 2]) << "thread " << i; });
}

TEST_F(Threads, OpenDevicesOfTheirOwn) {
  on_threads([&](int i) {
    Device device = Device::open();
    EXPECT_EQ(histogram_after(device, maps_, unknown_, i),
              histogram_after(device, maps_, unknown_, i));
  });
}

TEST_F(Threads, ReadAndWriteFiles) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("palpate_threads_test." + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  on_threads([&](int i) {
    const auto path = folder / (std::to_string(i) + ".h5");
    for (int round = 0; round < 3; ++round) {
      write_recording(path, unknown_);
      EXPECT_EQ(read_recording(path).pressure, unknown_.pressure);
      write_map(path, maps_[0].map);
      EXPECT_EQ(read_map(path).log_odds, maps_[0].map.log_odds);
      EXPECT_THROW(read_map(folder / "missing.h5"), Error);
    }
  });
  std::filesystem::remove_all(folder);
}

TEST(Log, TakesTheMessagesOfAllThreadsOneAtATime) {
  int messages = 0;  // no atomic: the library calls one at a time
  set_log([&](LogLevel, const std::string&) { ++messages; });
  on_threads([](int) { Device::open(); });
  set_log({});
  EXPECT_EQ(messages, threads);
}

}  // namespace palpate::threads_test
