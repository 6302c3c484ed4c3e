// What a child of fork() may do with the objects of its parent.
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "letters.hpp"
#include "support/errors.hpp"

namespace palpate::fork_test {

/// Whether the work throws the Error of an object of the parent.
bool is_refused(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return std::string(error.what()).find("belongs to the parent process") != std::string::npos;
  }
  return false;
}

/// The status with which a child ends that does this.
int status_of_child(const std::function<int()>& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::_exit(work());
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
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
  const int status = status_of_child([&] {
    for (std::size_t i = 0; i < uses.size(); ++i) {
      if (!is_refused(uses[i])) {
        return static_cast<int>(i) + 1;
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
    return same ? 0 : 100;
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
  EXPECT_EQ(status_of_child([] {
              Device device = Device::open();
              return letter_maps(device).size() == 3 ? 0 : 1;
            }),
            0);
}

}  // namespace palpate::fork_test
