#pragma once

#include <hdf5.h>

#include <functional>
#include <map>
#include <string>
#include <utility>

#include "io/hdf5_writer.hpp"

namespace palpate {

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

/// Opens a saved file for a part of a type that Palpate does not write itself.
inline void edit(const std::filesystem::path& path, const std::function<void(hid_t)>& change) {
  const Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
  ASSERT_TRUE(file.valid());
  change(file.get());
}

/// Two touches by an array of three elements.
inline FileParts recording_parts() {
  FileParts parts;
  parts.attribute("format", "palpate.recording")
      .attribute("version", 1)
      .attribute("object", "A")
      .attribute("pressure_unit", "kPa")
      .attribute("length_unit", "mm")
      .dataset("pressure", {2, 3}, 1.0)
      .dataset("sensor_pose", {2, 3}, 0.5)
      .dataset("elements", {3, 2}, 0.25);
  return parts;
}

inline FileParts map_parts() {
  FileParts parts;
  parts.attribute("format", "palpate.map")
      .attribute("version", 1)
      .attribute("label", "A")
      .attribute("cell_mm", 0.5)
      .attribute("origin_mm", std::vector<double>{-1.0, 2.0})
      .attribute("prior", 0.2)
      .attribute("symmetry", 1)
      .dataset("log_odds", {2, 3}, -1.0);
  return parts;
}

inline FileParts posterior_parts() {
  FileParts parts;
  parts.attribute("format", "palpate.posterior")
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
  return parts;
}

}  // namespace palpate
