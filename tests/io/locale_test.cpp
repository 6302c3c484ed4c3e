// A host program may show its users decimal commas; no file is read or written differently.

#include <gtest/gtest.h>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "palpate/scene.hpp"
#include "palpate/simulation.hpp"
#include "support/host_locale.hpp"

namespace palpate::locale_test {

class HostWithDecimalCommas : public OneFile {
 protected:
  HostWithDecimalCommas() : OneFile("s.yaml") {}

  Scene scene_of(const std::string& yaml) const {
    put_bytes(path_, yaml);
    return read_scene(path_);
  }
};

TEST_F(HostWithDecimalCommas, WritesTheSameBytesAndReadsThem) {
  OccupancyGrid map{.label = "A",
                    .cell_mm = 0.5,
                    .origin_mm = {-1234567.5, 1.125},
                    .nx = 1200,
                    .ny = 1,
                    .log_odds = std::vector<float>(1200, 1.5F)};
  Recording recording;
  recording.T_robot_sensor = {{{1.5, 2.0}, 3.0}};
  recording.pressure = {0.5};
  recording.elements_mm = {{1.125, 0.0}};
  const auto bytes_written = [&] {
    write_map(folder_ / "m.h5", map);
    write_map_server(folder_ / "m.yaml", map);
    write_recording(folder_ / "r.h5", recording);
    return bytes_of(folder_ / "m.h5") + bytes_of(folder_ / "m.yaml") + bytes_of(folder_ / "m.pgm") +
           bytes_of(folder_ / "r.h5");
  };
  const std::string expected = bytes_written();
  EXPECT_NE(expected.find("resolution: 0.0005\n"), std::string::npos);
  const HostLocale locale;
  EXPECT_TRUE(bytes_written() == expected);
  EXPECT_EQ(read_map(folder_ / "m.h5").origin_mm.y, 1.125);
  EXPECT_EQ(read_recording(folder_ / "r.h5").elements_mm[0].x, 1.125);
}

TEST_F(HostWithDecimalCommas, ReadsTheSameTextsAndSaysTheSame) {
  put_bytes(folder_ / "e.txt", "1.125 -2.250 # one\n\n\t+1.500\t3e0 \r\n");
  put_bytes(folder_ / "p.txt", "0 0\n1.500 0\n0 2.125\n");
  const std::string said = refusal([&] { scene_of("ratio: 1234.5\n"); });
  const HostLocale locale;
  EXPECT_EQ(refusal([&] { scene_of("ratio: 1234.5\n"); }), said);
  const Scene scene = scene_of(
      "threshold: 1.500\nratio: +0.25\ngamma: 1e-1\nprior: .125\n"
      "array: [[1.125, -2.250], [1.500, 3]]\nnone: 1000.500\n"
      "region: {x_mm: [-1.500, 1.500], theta_deg: [0, 360]}\nbins: [25, 1000, 16]\n");
  const std::vector<glm::dvec2> elements_mm{{1.125, -2.25}, {1.5, 3.0}};
  EXPECT_EQ(scene.array_mm, elements_mm);
  EXPECT_EQ(scene.options.at("none"), "1000.500");
  EXPECT_EQ(scene.options.at("x-mm"), "-1.500:1.500");
  EXPECT_EQ(scene_of("array: e.txt\n").array_mm, elements_mm);
  EXPECT_EQ(make_shape((folder_ / "p.txt").string()).polygons.at(0),
            (std::vector<glm::dvec2>{{0.0, 0.0}, {1.5, 0.0}, {0.0, 2.125}}));
}

TEST_F(HostWithDecimalCommas, NumbersWithDecimalCommasAreRefused) {
  const HostLocale locale;
  for (const char* text :
       {"threshold: 1,5", "threshold: 1.500,25", "bins: [1.000, 1, 1]", "threshold: 1.5 2"}) {
    expect_named(refusal([&] { scene_of(text); }), {"line 1"});
  }
  put_bytes(folder_ / "e.txt", "1,5 2\n");
  expect_named(input_error([&] { scene_of("array: e.txt\n"); }), {"e.txt:1:"});
}

}  // namespace palpate::locale_test
