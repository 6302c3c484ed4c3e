#include <gtest/gtest.h>
#include <unistd.h>

#include <tuple>

#include "file_parts.hpp"
#include "model/stream_time.hpp"
#include "palpate/files.hpp"
#include "same.hpp"
#include "support/host_locale.hpp"
#include "support/limits.hpp"

namespace palpate::recording_test {

Recording small_recording() {
  Recording recording;
  recording.object = "Ä";
  recording.T_robot_sensor = {{{1.0, 2.0}, 3.0}, {{-4.0, 0.1}, -70.0}};
  recording.pressure = {0.0, -1.5, 2.25, 1e6, 0.5, 3.0};
  recording.elements_mm = {{-1.0, 0.1}, {0.0, 0.2}, {1.0, 0.3}};
  return recording;
}

class RecordingFile : public OneFile {
 protected:
  std::string message() const {
    return refusal([&] { read_recording(path_); });
  }
  std::string message(const FileParts& parts) const {
    parts.save(path_);
    return message();
  }
};

TEST_F(RecordingFile, ComesBackAsItWasWrittenFromTheSameBytes) {
  const Recording written = small_recording();
  write_recording(path_, written);
  const std::string bytes = bytes_of(path_);
  const HostLocale locale;  // of a program whose numbers have decimal commas
  write_recording(path_, written);
  EXPECT_EQ(bytes_of(path_), bytes);
  // HDF5 loads a file of the name that it is given for the one in memory, and frees it again.
  const std::filesystem::path here = std::filesystem::current_path();
  put_bytes(folder_ / "palpate", std::string(4 << 20, '?'));
  std::filesystem::current_path(folder_.path());
  write_recording(path_, written);
  std::filesystem::current_path(here);
  EXPECT_EQ(bytes_of(path_), bytes);

  const Recording read = read_recording(path_);
  expect_same(read, written);
  EXPECT_EQ(read.path, path_.string());
  edit(path_, [](hid_t file) {
    const Hdf5Handle pressure(H5Dget_type(dataset_of(file, "pressure").get()), H5Tclose);
    EXPECT_EQ(H5Tget_size(pressure.get()), sizeof(float)) << "where float holds them";
    // Other programs decode texts by what the file says of them.
    const Hdf5Handle object(H5Aopen(file, "object", H5P_DEFAULT), H5Aclose);
    const Hdf5Handle text(H5Aget_type(object.get()), H5Tclose);
    EXPECT_EQ(H5Tget_cset(text.get()), H5T_CSET_UTF8);
  });
}

// What a stream may hold, to the extremes of its numbers and texts.
Recording extreme_stream() {
  Recording r = small_recording();
  r.rows = "frames";
  r.pressure_unit = "raw";
  r.object = "";
  r.sensor = "触覚 \xf0\x9f\x96\x90";
  r.serial = std::string(100'000, 'x');
  r.T_robot_sensor[1] = {{nan, nan}, nan};
  r.pressure = {0.1, nan, -0.0, 1.7e308, 5e-324, -1e300};
  r.elements_mm[2] = {-0.0, 1.7e308};
  r.time_s = {1.7e308, -5.0};
  r.device_time_s = {nan, 5e-324};
  r.lost_before = {0, largest_count};
  r.valid = {1, 1, 0};
  r.baseline = {-0.0, 1e300, nan};
  r.truth = {.object = "a b", .T_object_robot = {{-0.0, 1.0}, 1e300}};
  return r;
}

// Whose array changes, and of which a reading is not valid.
Recording recording_of_two_arrays() {
  Recording r = small_recording();
  r.elements_mm = {{-1, 0}, {0, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}};
  r.valid = {1, 1, 1, 1, 0, 1};
  r.pressure[4] = infinity;
  return r;
}

TEST_F(RecordingFile, ComesBackWhateverItMayHold) {
  Recording of_dead = small_recording();
  of_dead.pressure = {0.1, nan, 2.25, 1e6, infinity, 3.0};
  of_dead.valid = {1, 0, 1};
  Recording without_poses = extreme_stream();
  without_poses.T_robot_sensor[0] = {{nan, nan}, nan};
  for (const Recording& written :
       {of_dead, extreme_stream(), without_poses, recording_of_two_arrays()}) {
    write_recording(path_, written);
    expect_same(read_recording(path_), written);
  }
}

TEST_F(RecordingFile, IsNotWrittenWhereItCouldNotBeRead) {
  const auto expect_refused = [&](const char* named, Recording recording, const auto& spoil) {
    spoil(recording);
    expect_named(refusal([&] { write_recording(path_, recording); }), {named});
  };
  const Recording sound = extreme_stream();
  const Recording of_two = recording_of_two_arrays();
  using R = Recording;
  for (const auto& [named, text] : {std::pair{"'object'", &R::object},
                                    {"'sensor'", &R::sensor},
                                    {"'serial'", &R::serial},
                                    {"'pressure_unit'", &R::pressure_unit},
                                    {"'rows'", &R::rows}}) {
    expect_refused(named, sound, [&](R& r) { r.*text = "caf\xe9"; });
  }
  expect_refused("'pressure_unit' = 'psi'", sound, [](R& r) { r.pressure_unit = "psi"; });
  expect_refused("'rows' = 'columns'", sound, [](R& r) { r.rows = "columns"; });
  expect_refused("'true_object'", sound, [](R& r) { r.truth->object = "\xc3"; });
  expect_refused("'true_T_object_robot'", sound,
                 [](R& r) { r.truth->T_object_robot.theta_rad = infinity; });
  expect_refused("'baseline'[1]", sound, [](R& r) { r.baseline[1] = nan; });
  expect_refused("'elements', position 1", sound, [](R& r) { r.elements_mm[1].y = nan; });
  expect_refused("'elements', position 4", of_two, [](R& r) { r.elements_mm[4].x = infinity; });
  expect_refused("'pressure'[1, 0]", sound, [](R& r) { r.pressure[3] = infinity; });
  expect_refused("'pressure'[0, 1]", of_two, [](R& r) { r.pressure[1] = nan; });
  expect_refused("'sensor_pose'[1]", of_two, [](R& r) { r.T_robot_sensor[1] = {{nan, nan}, nan}; });
  for (const Pose& half : {Pose{{0, nan}, nan}, Pose{{nan, 0}, nan}, Pose{{nan, nan}, 0}}) {
    expect_refused("'sensor_pose'[0]", sound, [&](R& r) { r.T_robot_sensor[0] = half; });
  }
  expect_refused("'time'[1]", sound, [](R& r) { r.time_s[1] = nan; });
  expect_refused("'device_time'[0]", sound, [](R& r) { r.device_time_s[0] = -infinity; });
  expect_refused("'lost_before'[0]", sound, [](R& r) { r.lost_before[0] = largest_count + 1; });
  expect_refused("5 pressures", sound, [](R& r) { r.pressure.pop_back(); });
  expect_refused("5 elements", of_two, [](R& r) { r.elements_mm.pop_back(); });
  expect_refused("0 elements", sound, [](R& r) { r.elements_mm.clear(); });
  expect_refused("2 valid", sound, [](R& r) { r.valid.pop_back(); });
  expect_refused("1 times", sound, [](R& r) { r.time_s.pop_back(); });
  expect_refused("6 baseline", sound, [](R& r) { r.baseline.assign(6, 0.0); });
  expect_refused("1 device times", sound, [](R& r) { r.device_time_s.pop_back(); });
  expect_refused("1 lost counts", sound, [](R& r) { r.lost_before.pop_back(); });
  expect_refused("0 poses", {}, [](R&) {});
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(RecordingFile, KeepsWhatItsLogsShowed) {
  Recording written = small_recording();
  written.findings = {{"clock", 8.8, "ahead; `pose-delay 0.62`", {"pose-delay 0.62"}},
                      {"tilt", 0.0, "t"},
                      {"element_order", 5.0, "o", {"first-element top-left", "order rows"}}};
  write_recording(path_, written);
  const Recording read = read_recording(path_);
  ASSERT_EQ(read.findings.size(), 3u);
  const auto told = [](const SetupFinding& f) {
    return std::tie(f.what, f.nats, f.words, f.options);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(told(read.findings[i]), told(written.findings[i]));
  }
  for (const char* spoilt : {"[", "{}", "[1]", "[{\"what\": 2}]"}) {
    expect_named(message(recording_parts().attribute("findings", std::string(spoilt))),
                 {"attribute 'findings' is no JSON array"});
  }
}

TEST_F(RecordingFile, IgnoresWhatItDoesNotKnow) {
  recording_parts().attribute("weather", "fair").dataset("torque", {7}).save(path_);
  EXPECT_EQ(read_recording(path_).size(), 2u);
}

TEST_F(RecordingFile, ReadsOtherTypesOfNumbersAndStrings) {
  recording_parts().without("object").without("pressure").without("version").save(path_);
  edit(path_, [](hid_t file) {
    const Hdf5Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(text.get(), 5);
    H5Tset_strpad(text.get(), H5T_STR_SPACEPAD);
    const Hdf5Handle scalar(H5Screate(H5S_SCALAR), H5Sclose);
    H5Awrite(new_attribute(file, "object", text.get(), scalar).get(), text.get(), "key  ");
    // A list of one, in the other byte order.
    const int number = 1;
    H5Awrite(new_attribute(file, "version", H5T_STD_U64BE, space_of({1})).get(), H5T_NATIVE_INT,
             &number);
    const std::int16_t values[] = {0, -1, 255, 3, 4, 32767};
    put_values(new_dataset(file, "pressure", H5T_STD_I16BE, space_of({2, 3})), H5T_NATIVE_INT16,
               values);
    // h5py's bool.
    const Hdf5Handle truth(H5Tenum_create(H5T_STD_I8LE), H5Tclose);
    const std::int8_t levels[] = {0, 1};
    H5Tenum_insert(truth.get(), "FALSE", &levels[0]);
    H5Tenum_insert(truth.get(), "TRUE", &levels[1]);
    const std::int8_t alive[] = {1, 0, 1};
    put_values(new_dataset(file, "valid", truth.get(), space_of({3})), truth.get(), alive);
  });
  const Recording read = read_recording(path_);
  EXPECT_EQ(read.object, "key");
  EXPECT_EQ(read.pressure, (std::vector<double>{0, -1, 255, 3, 4, 32767}));
  EXPECT_EQ(read.valid, (std::vector<std::uint8_t>{1, 0, 1}));
}

TEST_F(RecordingFile, NamesDatasetsThatDisagree) {
  const std::tuple<const char*, Hdf5Writer::Shape, const char*> rows[] = {
      {"elements", {4, 2}, "[4, 2]; 'pressure' is [2, 3], so make it [3, 2] or [2, 3, 2]"},
      {"elements", {3, 3}, "[3, 3];"},
      {"elements", {3, 3, 2}, "[3, 3, 2];"},
      {"elements", {6}, "[6];"},
      {"sensor_pose", {1, 3}, "[1, 3]; 'pressure' is [2, 3], so make it [2, 3]"},
      {"sensor_pose", {2, 4}, "[2, 4];"},
      {"valid", {2}, "[2]; 'pressure' is [2, 3], so make it [3] or [2, 3]"},
      {"valid", {3, 2}, "[3, 2];"},
      {"time", {3}, "[3]; 'pressure' is [2, 3], so make it [2]"},
      {"pressure", {6}, "1 dimensions; give it 2"},
      {"pressure", {0, 3}, "[0, 3]; record at least one"},
      {"pressure", {2, 0}, "[2, 0]; record at least one"}};
  for (const auto& [name, shape, named] : rows) {
    expect_named(message(recording_parts().dataset(name, shape)),
                 {("'" + std::string(name) + "'").c_str(), named});
  }
}

TEST_F(RecordingFile, NamesWhatIsMissing) {
  for (const char* name : {"format", "version", "object", "pressure_unit", "length_unit",
                           "pressure", "sensor_pose", "elements"}) {
    expect_named(message(recording_parts().without(name)), {name, "missing"});
  }
  expect_named(message(recording_parts().attribute("true_object", "A")),
               {"'true_T_object_robot'", "missing"});
}

// IsNotWrittenWhereItCouldNotBeRead has the rules that hold for both.
TEST_F(RecordingFile, NamesValuesThatAreNoNumbers) {
  const auto spoilt = [&](const char* name, const Hdf5Writer::Shape& shape, const auto& values) {
    return message(recording_parts().dataset(name, shape, values));
  };
  expect_named(spoilt("pressure", {2, 3}, std::vector<double>{1, 2, 3, 4, nan, 6}),
               {"'pressure'[1, 1]", "nan"});
  expect_named(spoilt("elements", {3, 2}, infinity), {"'elements'", "inf"});
  expect_named(spoilt("valid", {3}, nan), {"'valid'", "NaN"});
}

TEST_F(RecordingFile, NamesAttributesItCannotTake) {
  const auto spoilt = [&](const char* name, auto value) {
    return message(recording_parts().attribute(name, value));
  };
  expect_named(spoilt("pressure_unit", "psi"), {"'pressure_unit'", "'psi'", "'kPa' or 'raw'"});
  expect_named(spoilt("length_unit", "m"), {"'length_unit'", "'m'", "'mm'"});
  expect_named(spoilt("version", 2), {"'version'", "2", "newer"});
  expect_named(spoilt("version", 0), {"'version'", "0", "from 1"});
  expect_named(spoilt("version", 1.5), {"'version'", "1.5"});
  expect_named(spoilt("version", "1"), {"'version'", "numbers"});
  expect_named(spoilt("object", 7), {"'object'", "string"});
  expect_named(spoilt("object", "a\nb"), {"'object'", "printable"});
  expect_named(spoilt("object", "\xff"), {"'object'", "UTF-8"});
  expect_named(spoilt("format", "palpate.map"), {"'palpate.map'", "a map", "recording"});
  expect_named(spoilt("format", "palpate.posterior"), {"a posterior"});
  expect_named(spoilt("format", "palpate.video"), {"'palpate.video'", "unknown"});
}

TEST_F(RecordingFile, NamesDatasetsOfOtherTypes) {
  recording_parts().without("pressure").save(path_);
  edit(path_, [](hid_t file) {
    Hdf5Handle(H5Gcreate2(file, "pressure", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  });
  expect_named(message(), {"'pressure'", "cannot be read"});
  recording_parts().save(path_);
  edit(path_, [](hid_t file) {
    const Hdf5Handle type(H5Tcreate(H5T_OPAQUE, 4), H5Tclose);
    new_dataset(file, "time", type.get(), space_of({2}));
  });
  expect_named(message(), {"'time'", "type"});
}

// h5py's Empty: a type and a shape of nothing.
TEST_F(RecordingFile, NamesWhatIsEmpty) {
  const Hdf5Handle nothing(H5Screate(H5S_NULL), H5Sclose);
  recording_parts().without("version").save(path_);
  edit(path_, [&](hid_t file) { new_attribute(file, "version", H5T_NATIVE_INT, nothing); });
  expect_named(message(), {"'version'", "0 numbers"});
  recording_parts()
      .dataset("pressure", {1, 3}, 1.0)
      .dataset("sensor_pose", {1, 3}, 0.5)
      .without("object")
      .save(path_);
  edit(path_, [&](hid_t file) {
    const Hdf5Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
    new_attribute(file, "object", text.get(), nothing);
  });
  EXPECT_EQ(read_recording(path_).object, "");
  edit(path_, [&](hid_t file) { new_dataset(file, "time", H5T_NATIVE_DOUBLE, nothing); });
  expect_named(message(), {"'time'", "[0]", "[1]"});
}

// h5py can declare a dataset of any size without storing any of it.
TEST_F(RecordingFile, RefusesShapesThatItsFileCannotHold) {
  constexpr hsize_t large = 1u << 30;
  // The smaller one is not stored either, though a file of its size could hold it.
  for (const auto& [shape, chunk, named] :
       {std::tuple{Extents{large, large}, Extents{}, "[1073741824, 1073741824]"},
        {{large, large}, {64, 64}, "[1073741824, 1073741824]"},
        {{2, 3}, {}, "[2, 3]"}}) {
    recording_parts().without("pressure").save(path_);
    edit(path_, [&, &shape = shape, &chunk = chunk](hid_t file) {
      new_dataset(file, "pressure", H5T_NATIVE_FLOAT, space_of(shape), storage_in(chunk).get());
    });
    expect_named(message(), {"'pressure'", named, "more than is stored"});
  }
}

TEST_F(RecordingFile, NamesWhatIsNoReadableHdf5File) {
  expect_named(message(), {"no such file"});
  put_bytes(path_, "");
  expect_named(message(), {"empty"});
  put_bytes(path_, std::string(3000, 'x'));
  expect_named(message(), {"not an HDF5 file"});
  recording_parts().save(path_);
  put_bytes(path_, bytes_of(path_).substr(0, 2000));
  expect_named(message(), {"truncated"});
  expect_named(input_error([&] { read_recording(folder_.path()); }),
               {folder_.path().c_str(), "folder"});
  expect_named(input_error([&] { read_recording("/dev/null"); }), {"/dev/null", "regular"});
  if (::geteuid() != 0) {  // root may read everything
    std::filesystem::permissions(path_, std::filesystem::perms::none);
    expect_named(message(), {"permissions"});
  }
}

// Files of another program, where they lie beside the source tree.
TEST(SharedFiles, RealPressesAreRead) {
  const auto presses = std::filesystem::path(PALPATE_SOURCE_DIR) / "../shared/data/presses";
  if (!std::filesystem::exists(presses)) {
    GTEST_SKIP() << presses << " is not there";
  }
  for (const auto& file : std::filesystem::directory_iterator(presses)) {
    const Recording recording = read_recording(file.path());
    EXPECT_EQ(recording.object, file.path().stem());
    EXPECT_EQ(recording.pressure_unit, "raw");
    EXPECT_EQ(recording.size(), 25u);
    EXPECT_EQ(recording.elements(), 1400u);
  }
}

}  // namespace palpate::recording_test
