// What the headers allow several threads to do at the same time; the preset `threads` runs these
// tests with ThreadSanitizer. What a child of fork() may do with the objects of its parent.
#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "letters.hpp"
#include "support/child_process.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::threads_test {

/// Calls `work(i)` on each of `threads` threads, all at the same time.
void on_threads(int threads, const std::function<void(int)>& work) {
  std::atomic<int> ready = 0;
  std::vector<std::jthread> running;
  for (int i = 0; i < threads; ++i) {
    running.emplace_back([&, i] {
      ++ready;
      while (ready < threads) {
      }
      work(i);
    });
  }
}

class Threads : public testing::Test {
 protected:
  std::vector<double> histogram_after(Device& device, std::size_t first) const {
    PoseHistogram belief(device, maps_, {.lattice = small_lattice()});
    for (std::size_t i = first; i < unknown_.size(); ++i) {
      belief.update(unknown_.touch(i));
      belief.estimate();
    }
    return belief.log_likelihood(1);
  }
  std::vector<double> particles() {
    ParticleFilter filter(device_, maps_, {.particles = 500, .seed = 7});
    filter.update(unknown_.touches(0, unknown_.size()));
    return filter.estimate().identity;
  }
  std::vector<double> gains_after(std::size_t touches) {
    PoseHistogram belief(device_, maps_, {.lattice = small_lattice()});
    belief.update(unknown_.touches(0, touches));
    std::vector<double> gains;
    for (const TouchGain& gain : belief.expected_gain(
             random_poses(20, /*seed=*/4), digitacts_array(), {.samples = 32, .seed = 5})) {
      gains.push_back(gain.both());
    }
    return gains;
  }
  std::vector<double> map_of_e() {
    const std::vector<float> log_odds = letter_maps(device_)[1].map.log_odds;
    return {log_odds.begin(), log_odds.end()};
  }

  Device device_ = Device::open();
  std::vector<Hypothesis> maps_ = letter_maps(device_);
  Recording unknown_ = unknown_letter(6);
};

// Planning divides the candidates among threads of its own.
TEST_F(Threads, ShareADeviceWithTheResultsOfOneThread) {
  const std::vector<std::function<std::vector<double>()>> works = {
      [&] { return histogram_after(device_, 0); },
      [&] { return histogram_after(device_, 2); },
      [&] { return particles(); },
      [&] { return map_of_e(); },
      [&] { return gains_after(1); },
      [&] { return gains_after(2); },
      [&] {
        Device own = Device::open();
        return histogram_after(own, 0);
      }};
  std::vector<std::vector<double>> alone;
  for (const auto& work : works) {
    alone.push_back(work());
  }
  EXPECT_EQ(alone.back(), alone.front()) << "a device of its own";
  on_threads(static_cast<int>(works.size()), [&](int i) { EXPECT_EQ(works[i](), alone[i]) << i; });
}

TEST_F(Threads, ReadAndWriteFiles) {
  const ScratchFolder folder;
  on_threads(4, [&](int i) {
    const auto path = folder / (std::to_string(i) + ".h5");
    for (int round = 0; round < 3; ++round) {
      write_recording(path, unknown_);
      EXPECT_EQ(read_recording(path).pressure, unknown_.pressure);
      write_map(path, maps_[0].map);
      EXPECT_EQ(read_map(path).log_odds, maps_[0].map.log_odds);
      EXPECT_THROW(read_map(folder / "missing.h5"), Error);
    }
  });
}

TEST(Log, TakesTheMessagesOfAllThreadsOneAtATime) {
  int messages = 0;  // no atomic: the library calls one at a time
  set_log([&](LogLevel, const std::string&) { ++messages; });
  on_threads(4, [](int) { Device::open(); });
  set_log({});
  EXPECT_EQ(messages, 4);
}

TEST(Fork, RefusesTheParentsObjectsInAChildAndLetsThemBeDestroyed) {
  std::optional<Device> device = Device::open();
  const std::vector<Hypothesis> maps = letter_maps(*device);
  const Recording unknown = unknown_letter(2);
  std::optional<PoseHistogram> histogram(std::in_place, *device, maps,
                                         HistogramOptions{.lattice = small_lattice()});
  std::optional<ParticleFilter> particles(std::in_place, *device, maps,
                                          ParticleOptions{.particles = 100});
  std::optional<BoundedPosterior> bounded(std::in_place, maps,
                                          BoundedOptions{.lattice = small_lattice()});
  std::optional<MapBuilder> builder(std::in_place, *device, MapOptions{});
  const std::vector<Touch> touches = {unknown.touch(0), unknown.touch(1)};
  histogram->update(touches);
  bounded->update(touches);
  const std::vector<double> identity = bounded->estimate().identity;
  const std::vector<std::function<void()>> uses = {
      [&] { histogram->update(touches); },
      [&] { histogram->estimate(); },
      [&] { particles->update(touches); },
      [&] { bounded->estimate(); },
      [&] { builder->add(touches); },
      [&] { PoseHistogram(*device, maps, {.lattice = small_lattice()}); },
      [&] { Device::open(); },
      [&] { Device::list(); }};
  const int status = status_of([&] {
    for (std::size_t i = 0; i < uses.size(); ++i) {
      if (input_error(uses[i]).find("belongs to the parent process") == std::string::npos) {
        ::_exit(static_cast<int>(i) + 1);
      }
    }
    // A belief that the child makes without a device is its own.
    BoundedPosterior own(maps, {.lattice = small_lattice()});
    own.update(touches);
    const bool same = own.estimate().identity == identity;
    *bounded = std::move(own);
    bounded.reset();
    histogram.reset();
    particles.reset();
    builder.reset();
    device.reset();
    ::_exit(same ? 0 : 100);
  });
  EXPECT_EQ(status, 0) << "use " << WEXITSTATUS(status);
  histogram->update(touches);  // the parent goes on
  EXPECT_EQ(bounded->estimate().identity, identity);
}

TEST(Fork, LetsAChildOpenADeviceWhereItsParentHasClosedAll) {
  {
    Device device = Device::open();
    letter_maps(device);
  }
  EXPECT_EQ(status_of([] {
              Device device = Device::open();
              EXPECT_EQ(letter_maps(device).size(), 3U);
            }),
            0);
}

}  // namespace palpate::threads_test
