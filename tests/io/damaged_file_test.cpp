// libhdf5 is known to crash and to loop on damaged files; Palpate must do neither.

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <functional>
#include <random>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "palpate/scene.hpp"
#include "scratch_folder.hpp"

namespace palpate::damaged_file_test {

using Read = std::function<void(const std::filesystem::path&)>;

std::string good_file(const FileParts& parts) {
  const ScratchFolder folder;
  parts.save(folder / "good.h5");
  return bytes_of(folder / "good.h5");
}

// Reads the bytes as a file: all is well, or an Error that names it. Returns whether all is well.
bool survives(const std::filesystem::path& path, const std::string& bytes, const Read& read) {
  put_bytes(path, bytes);
  try {
    read(path);
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input) << error.what();
    expect_named(error.what(), {path.c_str()});
    return false;
  }
}

void expect_robust(const std::string& good, const Read& read) {
  const ScratchFolder folder;
  const std::filesystem::path path = folder / "damaged";
  ASSERT_TRUE(survives(path, good, read));
  // One of these damages, to a recording, makes libhdf5 loop, for the 2 s that its reader lets it.
  std::mt19937 random(6);
  const auto below = [&](std::size_t bound) { return random() % bound; };
  for (int k = 0; k < 60; ++k) {
    survives(path, good.substr(0, below(good.size())), read);
  }
  int refused = 0;
  for (int k = 0; k < 160; ++k) {
    std::string bytes = good;
    for (int flips = k % 2 == 0 ? 1 : 8; flips > 0; --flips) {
      char& byte = bytes[below(bytes.size())];
      byte = static_cast<char>(byte ^ (1 << below(8)));
    }
    refused += survives(path, bytes, read) ? 0 : 1;
  }
  EXPECT_GT(refused, 0) << "the damage hit nothing that matters";
  // Less than twice what the readers were seen to need here, 130 MiB, sanitizers aside.
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
#ifndef __SANITIZE_ADDRESS__
  EXPECT_LT(usage.ru_maxrss, 256 * 1024);
#endif
}

TEST(DamagedFile, RecordingIsReadOrRefused) {
  expect_robust(good_file(recording_parts()), [](const auto& path) { read_recording(path); });
}

TEST(DamagedFile, MapIsReadOrRefused) {
  expect_robust(good_file(map_parts()), [](const auto& path) { read_map(path); });
}

// Unlike the others a compressed file.
TEST(DamagedFile, PosteriorIsReadOrRefused) {
  const ScratchFolder folder;
  Posterior posterior;
  posterior.objects = {"A", "B"};
  posterior.lattice.theta_rad.count = 2;
  posterior.log_likelihood.assign(2u * 2 * 25 * 25, -3.0);
  write_posterior(folder / "good.h5", posterior);
  expect_robust(bytes_of(folder / "good.h5"), [](const auto& path) { read_posterior(path); });
}

TEST(DamagedFile, SceneIsReadOrRefused) {
  expect_robust(
      "array: [[0, 1], [2, 3]]\nthreshold: 2.0\nobjects:\n  - {map: A.h5, label: A, weight: 1.0}\n"
      "region: {x_mm: [-10, 10], theta_deg: [0, 360]}\nbins: [25, 25, 16]\nfilter: histogram\n",
      [](const auto& path) { read_scene(path); });
}

}  // namespace palpate::damaged_file_test
