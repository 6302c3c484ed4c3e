#pragma once

#include <gtest/gtest.h>
#include <hdf5.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "io/hdf5_writer.hpp"
#include "support/child_process.hpp"
#include "support/scratch_folder.hpp"

namespace palpate {

/// Tests of one file, in a folder of its own.
class OneFile : public testing::Test {
 protected:
  explicit OneFile(const std::string& name = "file.h5") : path_(folder_ / name) {}

  /// The message of the input Error that `action` throws, which must name the file.
  template <class Action>
  std::string refusal(const Action& action) const {
    const std::string message = input_error(action);
    expect_named(message, {path_.c_str()});
    return message;
  }

  ScratchFolder folder_;
  std::filesystem::path path_;
};

/// An HDF5 file as parts by name, so that a test can spoil one of them.
class FileParts {
 public:
  FileParts& attribute(const std::string& name, auto value) {
    parts_[name] = [name, value](Hdf5Writer& file) { file.attribute(name.c_str(), value); };
    return *this;
  }
  FileParts& dataset(const std::string& name, const Hdf5Writer::Shape& shape, double value = 0) {
    std::size_t count = 1;
    for (const std::size_t extent : shape) {
      count *= extent;
    }
    return dataset(name, shape, std::vector<double>(count, value));
  }
  FileParts& dataset(const std::string& name, const Hdf5Writer::Shape& shape,
                     const std::vector<double>& values) {
    parts_[name] = [=](Hdf5Writer& file) { file.dataset(name.c_str(), shape, values); };
    return *this;
  }
  FileParts& without(const std::string& name) {
    parts_.erase(name);
    return *this;
  }
  void save(const std::filesystem::path& path) const {
    Hdf5Writer file(path);
    for (const auto& [name, write] : parts_) {
      write(file);
    }
    file.save();
  }

 private:
  std::map<std::string, std::function<void(Hdf5Writer&)>> parts_;
};

/// Two touches by an array of three elements.
inline FileParts recording_parts() {
  return FileParts()
      .attribute("format", "palpate.recording")
      .attribute("version", 1)
      .attribute("object", "A")
      .attribute("pressure_unit", "kPa")
      .attribute("length_unit", "mm")
      .dataset("pressure", {2, 3}, 1.0)
      .dataset("sensor_pose", {2, 3}, 0.5)
      .dataset("elements", {3, 2}, 0.25);
}

inline FileParts map_parts() {
  return FileParts()
      .attribute("format", "palpate.map")
      .attribute("version", 1)
      .attribute("label", "A")
      .attribute("cell_mm", 0.5)
      .attribute("origin_mm", std::vector<double>{-1.0, 2.0})
      .attribute("prior", 0.2)
      .attribute("symmetry", 1)
      .dataset("log_odds", {2, 3}, -1.0);
}

inline FileParts posterior_parts() {
  return FileParts()
      .attribute("format", "palpate.posterior")
      .attribute("version", 1)
      .attribute("objects", std::vector<std::string>{"A", "B"})
      .attribute("bins_x", 2)
      .attribute("bins_y", 3)
      .attribute("bins_theta", 4)
      .attribute("x_mm", std::vector<double>{-10.0, 10.0})
      .attribute("y_mm", std::vector<double>{-5.0, 5.0})
      .attribute("theta_rad", std::vector<double>{0.0, 6.0})
      .attribute("pivot_mm", std::vector<double>{1.0, 2.0})
      .dataset("log_likelihood", {2, 4, 3, 2}, -1.0);
}

// HDF5's own functions, for parts of kinds that Palpate does not write.

/// Opens a saved file and changes it.
inline void edit(const std::filesystem::path& path, const std::function<void(hid_t)>& change) {
  const Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
  ASSERT_TRUE(file.valid());
  change(file.get());
}

/// Marks a file as open, as a recorder that was killed leaves it.
inline void leave_open(const std::filesystem::path& path) {
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  set_appendable(access.get());
  status_of([&] { H5Fopen(path.c_str(), H5F_ACC_RDWR | H5F_ACC_SWMR_WRITE, access.get()); });
}

using Extents = std::vector<hsize_t>;

inline Hdf5Handle space_of(const Extents& extents, const hsize_t* most = nullptr) {
  return {H5Screate_simple(static_cast<int>(extents.size()), extents.data(), most), H5Sclose};
}

/// How a new dataset is stored: compressed in chunks, or as a whole where there is no chunk.
inline Hdf5Handle storage_in(const Extents& chunk) {
  Hdf5Handle storage(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  if (!chunk.empty()) {
    H5Pset_chunk(storage.get(), static_cast<int>(chunk.size()), chunk.data());
    H5Pset_deflate(storage.get(), 1);
  }
  return storage;
}

/// A new dataset, of which nothing is stored yet.
inline Hdf5Handle new_dataset(hid_t file, const char* name, hid_t type, const Hdf5Handle& space,
                              hid_t storage = H5P_DEFAULT) {
  Hdf5Handle dataset(H5Dcreate2(file, name, type, space.get(), H5P_DEFAULT, storage, H5P_DEFAULT),
                     H5Dclose);
  EXPECT_TRUE(dataset.valid()) << name;
  return dataset;
}

inline Hdf5Handle new_attribute(hid_t file, const char* name, hid_t type, const Hdf5Handle& space) {
  return {H5Acreate2(file, name, type, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose};
}

inline Hdf5Handle dataset_of(hid_t file, const char* name) {
  return {H5Dopen2(file, name, H5P_DEFAULT), H5Dclose};
}

inline void put_values(const Hdf5Handle& dataset, hid_t type, const void* values) {
  EXPECT_GE(H5Dwrite(dataset.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), 0);
}

}  // namespace palpate
