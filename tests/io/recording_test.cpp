#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "support/limits.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::recording_test {

Recording small_recording() {
  Recording recording;
  recording.object = "Ä";
  recording.T_robot_sensor = {{{1.0, 2.0}, 3.0}, {{-4.0, 0.1}, -70.0}};
  recording.pressure = {0.0, -1.5, 2.25, 1e6, 0.5, 3.0};
  recording.elements_mm = {{-1.0, 0.1}, {0.0, 0.2}, {1.0, 0.3}};
  return recording;
}

void expect_same(const Recording& read, const Recording& written) {
  EXPECT_EQ(read.object, written.object);
  EXPECT_EQ(read.pressure_unit, written.pressure_unit);
  EXPECT_EQ(read.rows, written.rows);
  EXPECT_EQ(read.pressure, written.pressure);
  EXPECT_EQ(read.elements_mm, written.elements_mm);
  EXPECT_EQ(read.valid, written.valid);
  EXPECT_EQ(read.time_s, written.time_s);
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read.T_robot_sensor[i].translation_mm, written.T_robot_sensor[i].translation_mm);
    EXPECT_EQ(read.T_robot_sensor[i].theta_rad, written.T_robot_sensor[i].theta_rad);
  }
}

class RecordingFile : public testing::Test {
 protected:
  // What reading the file says when the parts are saved to it.
  std::string message(const FileParts& parts) {
    parts.save(path_);
    const std::string text = input_error([&] { read_recording(path_); });
    expect_named(text, {path_.c_str()});
    return text;
  }

  Recording read(const FileParts& parts) {
    parts.save(path_);
    return read_recording(path_);
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "recording.h5";
};

TEST_F(RecordingFile, ComesBackAsItWasWritten) {
  const Recording written = small_recording();
  write_recording(path_, written);
  const Recording read = read_recording(path_);
  expect_same(read, written);
  EXPECT_EQ(read.path, path_.string());
  EXPECT_FALSE(read.truth);
}

TEST_F(RecordingFile, KeepsWhatItsLogsShowed) {
  Recording written = small_recording();
  written.findings = {{"clock", 8.8, "ahead; `pose-delay 0.62`", {"pose-delay 0.62"}},
                      {"tilt", 0.0, "t"},
                      {"element_order", 5.0, "o", {"first-element top-left", "order rows"}}};
  write_recording(path_, written);
  const Recording read = read_recording(path_);
  ASSERT_EQ(read.findings.size(), 3u);
  EXPECT_EQ(read.findings[0].what, "clock");
  EXPECT_EQ(read.findings[0].nats, 8.8);
  EXPECT_EQ(read.findings[0].words, written.findings[0].words);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read.findings[i].options, written.findings[i].options);
  }
  for (const char* spoilt : {"[", "{}", "[1]", "[{\"what\": 2}]"}) {
    SCOPED_TRACE(spoilt);
    expect_named(message(recording_parts().attribute("findings", std::string(spoilt))),
                 {"attribute 'findings' is no JSON array"});
  }
}

TEST_F(RecordingFile, KeepsEverythingOptional) {
  Recording written = small_recording();
  written.pressure_unit = "raw";
  written.rows = "frames";
  written.elements_mm = {{0, 0}, {1, 0}, {2, 0}, {0, 1}, {1, 1}, {2, 1}};
  written.valid = {1, 0, 1, 1, 1, 0};
  written.time_s = {1.7e9, 1.7e9 + 0.01};
  written.truth = Truth{"B", {{1.5, -2.5}, 4.0}};
  write_recording(path_, written);
  const Recording read = read_recording(path_);
  expect_same(read, written);
  ASSERT_TRUE(read.truth);
  EXPECT_EQ(read.truth->object, "B");
  EXPECT_EQ(read.truth->T_object_robot.translation_mm, glm::dvec2(1.5, -2.5));
  EXPECT_EQ(read.truth->T_object_robot.theta_rad, 4.0);
}

TEST_F(RecordingFile, KeepsPressureThatFloatCannotHold) {
  Recording written = small_recording();
  written.pressure[2] = 0.1;
  write_recording(path_, written);
  EXPECT_EQ(read_recording(path_).pressure, written.pressure);
}

TEST_F(RecordingFile, HalvesPressureThatFloatHolds) {
  Recording written = small_recording();
  write_recording(path_, written);
  edit(path_, [](hid_t file) {
    const Hdf5Handle dataset(H5Dopen2(file, "pressure", H5P_DEFAULT), H5Dclose);
    const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose);
    EXPECT_EQ(H5Tget_size(type.get()), sizeof(float));
  });
}

TEST_F(RecordingFile, IsTheSameBytesForTheSameContent) {
  write_recording(path_, small_recording());
  const std::string first = bytes_of(path_);
  write_recording(path_, small_recording());
  EXPECT_EQ(bytes_of(path_), first);
}

TEST_F(RecordingFile, LetsDeadElementsReadAnything) {
  Recording written = small_recording();
  written.pressure[1] = nan;
  written.pressure[4] = infinity;
  written.valid = {1, 0, 1};
  write_recording(path_, written);
  const Recording read = read_recording(path_);
  EXPECT_TRUE(std::isnan(read.pressure[1]));
  EXPECT_EQ(read.pressure[4], infinity);
  EXPECT_EQ(read.valid, written.valid);
}

TEST_F(RecordingFile, IgnoresWhatItDoesNotKnow) {
  EXPECT_EQ(read(recording_parts().attribute("weather", "fair").dataset("torque", {7})).size(), 2u);
}

TEST_F(RecordingFile, ReadsOtherTypesOfNumbersAndStrings) {
  recording_parts().without("object").without("pressure").without("version").save(path_);
  edit(path_, [](hid_t file) {
    const Hdf5Handle scalar(H5Screate(H5S_SCALAR), H5Sclose);
    const Hdf5Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(text.get(), 5);
    H5Tset_strpad(text.get(), H5T_STR_SPACEPAD);
    const Hdf5Handle object(
        H5Acreate2(file, "object", text.get(), scalar.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    H5Awrite(object.get(), text.get(), "key  ");
    // A list of one, in the other byte order.
    const hsize_t one = 1;
    const Hdf5Handle list(H5Screate_simple(1, &one, nullptr), H5Sclose);
    const Hdf5Handle version(
        H5Acreate2(file, "version", H5T_STD_U64BE, list.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const int number = 1;
    H5Awrite(version.get(), H5T_NATIVE_INT, &number);
    const hsize_t extents[] = {2, 3};
    const Hdf5Handle space(H5Screate_simple(2, extents, nullptr), H5Sclose);
    const Hdf5Handle pressure(H5Dcreate2(file, "pressure", H5T_STD_I16BE, space.get(), H5P_DEFAULT,
                                         H5P_DEFAULT, H5P_DEFAULT),
                              H5Dclose);
    const std::int16_t values[] = {0, -1, 255, 3, 4, 32767};
    H5Dwrite(pressure.get(), H5T_NATIVE_INT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
    // h5py's bool.
    const Hdf5Handle truth(H5Tenum_create(H5T_STD_I8LE), H5Tclose);
    const std::int8_t levels[] = {0, 1};
    H5Tenum_insert(truth.get(), "FALSE", &levels[0]);
    H5Tenum_insert(truth.get(), "TRUE", &levels[1]);
    const Hdf5Handle row(H5Screate_simple(1, &extents[1], nullptr), H5Sclose);
    const Hdf5Handle valid(
        H5Dcreate2(file, "valid", truth.get(), row.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        H5Dclose);
    const std::int8_t alive[] = {1, 0, 1};
    H5Dwrite(valid.get(), truth.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, alive);
  });
  const Recording read = read_recording(path_);
  EXPECT_EQ(read.object, "key");
  EXPECT_EQ(read.pressure, (std::vector<double>{0, -1, 255, 3, 4, 32767}));
  EXPECT_EQ(read.valid, (std::vector<std::uint8_t>{1, 0, 1}));
}

TEST_F(RecordingFile, NamesDatasetsThatDisagree) {
  const auto spoilt = [&](const char* name, const Hdf5Writer::Shape& shape) {
    return message(recording_parts().dataset(name, shape));
  };
  expect_named(spoilt("elements", {4, 2}), {"'elements'", "[4, 2]", "'pressure'", "[2, 3]"});
  expect_named(spoilt("elements", {3, 3}), {"'elements'", "[3, 3]", "[3, 2] or [2, 3, 2]"});
  expect_named(spoilt("elements", {3, 3, 2}), {"'elements'", "[3, 3, 2]"});
  expect_named(spoilt("elements", {6}), {"'elements'", "[6]"});
  expect_named(spoilt("sensor_pose", {1, 3}), {"'sensor_pose'", "[1, 3]", "[2, 3]"});
  expect_named(spoilt("sensor_pose", {2, 4}), {"'sensor_pose'", "[2, 4]"});
  expect_named(spoilt("valid", {2}), {"'valid'", "[2]", "[3] or [2, 3]"});
  expect_named(spoilt("valid", {3, 2}), {"'valid'", "[3, 2]"});
  expect_named(spoilt("time", {3}), {"'time'", "[3]", "[2]"});
  expect_named(spoilt("pressure", {6}), {"'pressure'", "1 dimensions", "2"});
  expect_named(spoilt("pressure", {0, 3}), {"'pressure'", "[0, 3]", "at least one"});
  expect_named(spoilt("pressure", {2, 0}), {"'pressure'", "[2, 0]", "at least one"});
}

TEST_F(RecordingFile, NamesWhatIsMissing) {
  for (const char* name : {"format", "version", "object", "pressure_unit", "length_unit"}) {
    expect_named(message(recording_parts().without(name)), {"attribute", name, "missing"});
  }
  for (const char* name : {"pressure", "sensor_pose", "elements"}) {
    expect_named(message(recording_parts().without(name)), {"dataset", name, "missing"});
  }
  expect_named(message(recording_parts().attribute("true_object", "A")),
               {"'true_T_object_robot'", "missing"});
}

TEST_F(RecordingFile, AStreamMayLackPoses) {
  // More rows than one piece of unknown poses.
  constexpr std::size_t n = 10'000;
  const Recording stream = read(recording_parts()
                                    .without("sensor_pose")
                                    .attribute("rows", "frames")
                                    .dataset("pressure", {n, 3}, 1.0));
  ASSERT_EQ(stream.size(), n);
  for (const Pose& pose : stream.T_robot_sensor) {
    ASSERT_TRUE(std::isnan(pose.translation_mm.x) && std::isnan(pose.translation_mm.y) &&
                std::isnan(pose.theta_rad));
  }
  EXPECT_EQ(stream.elements(), 3u);
}

TEST_F(RecordingFile, NamesValuesThatAreNoNumbers) {
  const std::vector<double> row_of_nan{1, 2, 3, 4, nan, 6};
  expect_named(message(recording_parts().dataset("pressure", {2, 3}, row_of_nan)),
               {"'pressure'[1, 1]", "nan", "'valid'"});
  expect_named(message(recording_parts().dataset("pressure", {2, 3}, infinity)),
               {"'pressure'[0, 0]", "inf"});
  expect_named(message(recording_parts().dataset("sensor_pose", {2, 3}, row_of_nan)),
               {"'sensor_pose'[1]", "nan"});
  expect_named(message(recording_parts().dataset("elements", {3, 2}, infinity)),
               {"'elements'", "inf"});
  expect_named(message(recording_parts().dataset("time", {2}, nan)), {"'time'[0]", "nan"});
  expect_named(message(recording_parts().dataset("valid", {3}, nan)), {"'valid'", "NaN"});
}

TEST_F(RecordingFile, NamesAttributesItCannotTake) {
  const auto spoilt = [&](const char* name, auto value) {
    return message(recording_parts().attribute(name, value));
  };
  expect_named(spoilt("pressure_unit", "psi"), {"'pressure_unit'", "'psi'", "'kPa' or 'raw'"});
  expect_named(spoilt("length_unit", "m"), {"'length_unit'", "'m'", "'mm'"});
  expect_named(spoilt("rows", "columns"), {"'rows'", "'columns'", "'touches' or 'frames'"});
  expect_named(spoilt("version", 2), {"'version'", "2", "newer", "update Palpate"});
  expect_named(spoilt("version", 0), {"'version'", "0", "from 1"});
  expect_named(spoilt("version", 1.5), {"'version'", "1.5"});
  expect_named(spoilt("version", "1"), {"'version'", "numbers"});
  expect_named(spoilt("object", 7), {"'object'", "string"});
  expect_named(spoilt("object", "a\nb"), {"'object'", "printable"});
  expect_named(spoilt("object", "\xff"), {"'object'", "UTF-8"});
  expect_named(spoilt("format", "palpate.map"), {"'palpate.map'", "a map", "`maps`", "recording"});
  expect_named(spoilt("format", "palpate.posterior"), {"a posterior", "palpate info"});
  expect_named(spoilt("format", "palpate.video"), {"'palpate.video'", "unknown"});
}

TEST_F(RecordingFile, NamesDatasetsOfOtherTypes) {
  recording_parts().without("pressure").save(path_);
  edit(path_, [](hid_t file) {
    Hdf5Handle(H5Gcreate2(file, "pressure", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  });
  expect_named(input_error([&] { read_recording(path_); }), {"'pressure'", "cannot be read"});
  recording_parts().without("time").save(path_);
  edit(path_, [](hid_t file) {
    const hsize_t two = 2;
    const Hdf5Handle space(H5Screate_simple(1, &two, nullptr), H5Sclose);
    const Hdf5Handle type(H5Tcreate(H5T_OPAQUE, 4), H5Tclose);
    Hdf5Handle(
        H5Dcreate2(file, "time", type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        H5Dclose);
  });
  expect_named(input_error([&] { read_recording(path_); }), {"'time'", "type"});
}

// h5py's Empty: a type and a shape of nothing.
TEST_F(RecordingFile, NamesWhatIsEmpty) {
  recording_parts().without("version").save(path_);
  edit(path_, [](hid_t file) {
    const Hdf5Handle nothing(H5Screate(H5S_NULL), H5Sclose);
    Hdf5Handle(H5Acreate2(file, "version", H5T_NATIVE_INT, nothing.get(), H5P_DEFAULT, H5P_DEFAULT),
               H5Aclose);
  });
  expect_named(input_error([&] { read_recording(path_); }), {"'version'", "0 numbers"});
  recording_parts()
      .dataset("pressure", {1, 3}, 1.0)
      .dataset("sensor_pose", {1, 3}, 0.5)
      .without("object")
      .save(path_);
  edit(path_, [](hid_t file) {
    const Hdf5Handle nothing(H5Screate(H5S_NULL), H5Sclose);
    const Hdf5Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
    Hdf5Handle(H5Acreate2(file, "object", text.get(), nothing.get(), H5P_DEFAULT, H5P_DEFAULT),
               H5Aclose);
  });
  EXPECT_EQ(read_recording(path_).object, "");
  edit(path_, [](hid_t file) {
    const Hdf5Handle nothing(H5Screate(H5S_NULL), H5Sclose);
    Hdf5Handle(H5Dcreate2(file, "time", H5T_NATIVE_DOUBLE, nothing.get(), H5P_DEFAULT, H5P_DEFAULT,
                          H5P_DEFAULT),
               H5Dclose);
  });
  expect_named(input_error([&] { read_recording(path_); }), {"'time'", "[0]", "[1]"});
}

// Other programs decode texts by what the file says of them.
TEST_F(RecordingFile, SaysThatItsTextsAreUtf8) {
  write_recording(path_, small_recording());
  edit(path_, [](hid_t file) {
    const Hdf5Handle object(H5Aopen(file, "object", H5P_DEFAULT), H5Aclose);
    const Hdf5Handle type(H5Aget_type(object.get()), H5Tclose);
    EXPECT_EQ(H5Tget_cset(type.get()), H5T_CSET_UTF8);
  });
}

// h5py can declare a dataset of any size without storing any of it.
TEST_F(RecordingFile, RefusesShapesThatItsFileCannotHold) {
  // The smaller one is not stored either, though a file of its size could hold it.
  constexpr hsize_t large = 1u << 30;
  for (const auto& [rows, columns, chunked] :
       {std::tuple{large, large, false}, {large, large, true}, {hsize_t{2}, hsize_t{3}, false}}) {
    recording_parts().without("pressure").save(path_);
    edit(path_, [&](hid_t file) {
      const hsize_t extents[] = {rows, columns};
      const Hdf5Handle space(H5Screate_simple(2, extents, nullptr), H5Sclose);
      const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
      if (chunked) {
        const hsize_t chunk[] = {64, 64};
        H5Pset_chunk(creation.get(), 2, chunk);
        H5Pset_deflate(creation.get(), 4);
      }
      Hdf5Handle(H5Dcreate2(file, "pressure", H5T_NATIVE_FLOAT, space.get(), H5P_DEFAULT,
                            creation.get(), H5P_DEFAULT),
                 H5Dclose);
    });
    expect_named(input_error([&] { read_recording(path_); }),
                 {"'pressure'", rows == large ? "[1073741824, 1073741824]" : "[2, 3]",
                  "more than is stored"});
  }
}

TEST_F(RecordingFile, NamesWhatIsNoReadableHdf5File) {
  const auto message_of = [&] { return input_error([&] { read_recording(path_); }); };
  expect_named(message_of(), {path_.c_str(), "no such file"});
  put_bytes(path_, "");
  expect_named(message_of(), {path_.c_str(), "empty"});
  put_bytes(path_, std::string(3000, 'x'));
  expect_named(message_of(), {path_.c_str(), "not an HDF5 file"});
  recording_parts().save(path_);
  put_bytes(path_, bytes_of(path_).substr(0, 2000));
  expect_named(message_of(), {path_.c_str(), "truncated"});
  expect_named(input_error([&] { read_recording(folder_.path()); }),
               {folder_.path().c_str(), "folder"});
  expect_named(input_error([&] { read_recording("/dev/null"); }), {"/dev/null", "regular"});
  if (::geteuid() == 0) {
    return;  // root may read everything
  }
  std::filesystem::permissions(path_, std::filesystem::perms::none);
  expect_named(message_of(), {path_.c_str(), "permissions"});
}

TEST_F(RecordingFile, IsNotWrittenWhereItCouldNotBeRead) {
  Recording spoilt = small_recording();
  spoilt.pressure.pop_back();
  expect_named(input_error([&] { write_recording(path_, spoilt); }), {path_.c_str(), "agree"});
  spoilt = small_recording();
  spoilt.pressure[0] = nan;
  expect_named(input_error([&] { write_recording(path_, spoilt); }), {path_.c_str(), "'pressure'"});
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace palpate::recording_test
