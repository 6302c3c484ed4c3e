// Inside another program's process, nothing forks, and a file is refused as in a child.

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>

#include "file_parts.hpp"
#include "io/hdf5_process.hpp"
#include "io/hdf5_reader.hpp"
#include "palpate/files.hpp"
#include "scratch_folder.hpp"

namespace palpate::reading_here_test {

// The tests of this program read as the command does, unless they say otherwise.
const bool as_the_command = (read_hdf5_in_children(true), true);

std::atomic<int> forks{0};
const int counted = ::pthread_atfork([] { ++forks; }, nullptr, nullptr);

class ReadingHere : public testing::Test {
 protected:
  ReadingHere() { read_hdf5_in_children(false); }
  ~ReadingHere() override { read_hdf5_in_children(true); }

  // Both ways of reading refuse the file in the same words.
  void expect_same_refusal(const std::function<void()>& read) {
    const std::string here = input_error(read);
    read_hdf5_in_children(true);
    EXPECT_EQ(here, input_error(read));
    read_hdf5_in_children(false);
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "file.h5";
};

TEST_F(ReadingHere, NothingForks) {
  ASSERT_EQ(counted, 0);
  recording_parts().save(path_);
  const int before = forks;
  const Recording recording = read_recording(path_);
  EXPECT_EQ(recording.pressure, std::vector<double>(6, 1.0));
  EXPECT_EQ(recording.elements_mm[2], glm::dvec2(0.25, 0.25));
  EXPECT_EQ(read_format(path_), "palpate.recording");
  EXPECT_FALSE(close_recording(path_));
  write_recording(folder_ / "copy.h5", recording);
  EXPECT_EQ(forks, before);
  read_hdf5_in_children(true);
  read_recording(path_);
  EXPECT_GT(forks, before) << "the count would not see a fork";
}

TEST_F(ReadingHere, ManyPiecesAreReadInOrder) {
  const std::size_t n = 3 * hdf5_piece / 7;
  std::vector<double> values(7 * n);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<double>(i);
  }
  recording_parts()
      .dataset("pressure", {n, 7}, values)
      .dataset("sensor_pose", {n, 3}, 0.5)
      .dataset("elements", {7, 2}, 0.25)
      .save(path_);
  EXPECT_EQ(read_recording(path_).pressure, values);
}

TEST_F(ReadingHere, ATruncatedFileIsRefusedAsInAChild) {
  recording_parts().save(path_);
  const std::string bytes = bytes_of(path_);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{7}, bytes.size() / 2, bytes.size() - 1}) {
    put_bytes(path_, bytes.substr(0, size));
    expect_same_refusal([&] { read_recording(path_); });
  }
}

TEST_F(ReadingHere, AFileIsRefusedByItsFieldAsInAChild) {
  for (const char* part : {"format", "version", "pressure", "sensor_pose", "elements"}) {
    recording_parts().without(part).save(path_);
    expect_same_refusal([&] { read_recording(path_); });
  }
  recording_parts().dataset("pressure", {6}).save(path_);
  expect_same_refusal([&] { read_recording(path_); });
  map_parts().dataset("log_odds", {2, 3}, std::numeric_limits<double>::quiet_NaN()).save(path_);
  expect_same_refusal([&] { read_map(path_); });
  expect_same_refusal([&] { read_recording(path_); });
}

// A shape of terabytes that is stored nowhere.
TEST_F(ReadingHere, AnAbsurdShapeTakesNoMemory) {
  recording_parts().without("pressure").save(path_);
  edit(path_, [](hid_t file) {
    const hsize_t extents[] = {hsize_t{1} << 40, 3};
    const Hdf5Handle space(H5Screate_simple(2, extents, nullptr), H5Sclose);
    const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    const hsize_t chunk[] = {2, 3};
    H5Pset_chunk(creation.get(), 2, chunk);
    const Hdf5Handle dataset(H5Dcreate2(file, "pressure", H5T_NATIVE_FLOAT, space.get(),
                                        H5P_DEFAULT, creation.get(), H5P_DEFAULT),
                             H5Dclose);
    EXPECT_TRUE(dataset.valid());
  });
  expect_same_refusal([&] { read_recording(path_); });
}

}  // namespace palpate::reading_here_test
