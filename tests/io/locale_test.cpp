// A host program may show its users decimal commas; no file is read or written differently.

#include <gtest/gtest.h>

#include "palpate/files.hpp"
#include "palpate/scene.hpp"
#include "palpate/simulation.hpp"
#include "support/host_locale.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::locale_test {

class HostWithDecimalCommas : public testing::Test {
 protected:
  // Every file that is written below, with its bytes.
  std::string bytes_written() {
    OccupancyGrid map;
    map.label = "A";
    map.cell_mm = 0.5;
    map.origin_mm = {-1234567.5, 1.125};
    map.nx = 1200;
    map.ny = 1;
    map.log_odds.assign(1200, 1.5F);
    write_map(folder_ / "m.h5", map);
    write_map_server(folder_ / "m.yaml", map);
    Recording recording;
    recording.T_robot_sensor = {{{1.5, 2.0}, 3.0}};
    recording.pressure = {0.5};
    recording.elements_mm = {{1.125, 0.0}};
    write_recording(folder_ / "r.h5", recording);
    return bytes_of(folder_ / "m.h5") + bytes_of(folder_ / "m.yaml") + bytes_of(folder_ / "m.pgm") +
           bytes_of(folder_ / "r.h5");
  }

  ScratchFolder folder_;
};

TEST_F(HostWithDecimalCommas, WritesTheSameBytes) {
  const std::string expected = bytes_written();
  EXPECT_NE(bytes_of(folder_ / "m.yaml").find("resolution: 0.0005\n"), std::string::npos);
  const HostLocale locale;
  EXPECT_TRUE(bytes_written() == expected);
}

TEST_F(HostWithDecimalCommas, ReadsTheSameScene) {
  put_bytes(folder_ / "s.yaml",
            "threshold: 1.500\nratio: +0.25\ngamma: 1e-1\nprior: .125\n"
            "array: [[1.125, -2.250], [1.500, 3]]\nnone: 1000.500\n"
            "region: {x_mm: [-1.500, 1.500], theta_deg: [0, 360]}\nbins: [25, 1000, 16]\n");
  const HostLocale locale;
  const Scene scene = read_scene(folder_ / "s.yaml");
  EXPECT_EQ(scene.array_mm, (std::vector<glm::dvec2>{{1.125, -2.25}, {1.5, 3.0}}));
  EXPECT_EQ(scene.options.at("none"), "1000.500");
  EXPECT_EQ(scene.options.at("x-mm"), "-1.500:1.500");
}

TEST_F(HostWithDecimalCommas, ReadsTheSameElementsAndPolygons) {
  put_bytes(folder_ / "e.txt", "1.125 -2.250 # one\n\n\t+1.500\t3e0 \r\n");
  put_bytes(folder_ / "p.txt", "0 0\n1.500 0\n0 2.125\n");
  const HostLocale locale;
  put_bytes(folder_ / "s.yaml", "array: e.txt\n");
  EXPECT_EQ(read_scene(folder_ / "s.yaml").array_mm,
            (std::vector<glm::dvec2>{{1.125, -2.25}, {1.5, 3.0}}));
  EXPECT_EQ(make_shape((folder_ / "p.txt").string()).polygons.at(0),
            (std::vector<glm::dvec2>{{0.0, 0.0}, {1.5, 0.0}, {0.0, 2.125}}));
}

TEST_F(HostWithDecimalCommas, ReadsTheSameFilesAndSaysTheSame) {
  bytes_written();
  put_bytes(folder_ / "s.yaml", "ratio: 1234.5\n");
  const std::string expected = input_error([&] { read_scene(folder_ / "s.yaml"); });
  const HostLocale locale;
  EXPECT_EQ(read_map(folder_ / "m.h5").origin_mm.y, 1.125);
  EXPECT_EQ(read_recording(folder_ / "r.h5").elements_mm[0].x, 1.125);
  EXPECT_EQ(input_error([&] { read_scene(folder_ / "s.yaml"); }), expected);
}

// Numbers with decimal commas are none, in either locale.
TEST_F(HostWithDecimalCommas, DecimalCommasAreRefused) {
  const HostLocale locale;
  for (const char* text : {"threshold: 1,5", "threshold: 1.500,25", "bins: [1.000, 1, 1]",
                           "threshold: 1.5 2", "threshold: nan", "threshold: .inf"}) {
    put_bytes(folder_ / "s.yaml", text);
    expect_named(input_error([&] { read_scene(folder_ / "s.yaml"); }), {"line 1", "give "});
  }
  put_bytes(folder_ / "e.txt", "1,5 2\n");
  put_bytes(folder_ / "s.yaml", "array: e.txt\n");
  expect_named(input_error([&] { read_scene(folder_ / "s.yaml"); }), {"e.txt:1:"});
}

}  // namespace palpate::locale_test
