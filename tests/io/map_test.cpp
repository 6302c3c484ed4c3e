#include <gtest/gtest.h>

#include <tuple>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "support/host_locale.hpp"
#include "support/limits.hpp"

namespace palpate::map_test {

OccupancyGrid small_map() {
  OccupancyGrid map{.label = "A",
                    .cell_mm = 0.5,
                    .origin_mm = {-3.5, 12.0},
                    .prior = 0.1,
                    .symmetry = 2,
                    .spread_mm = 0.7,
                    .suggested_symmetry = 0,
                    .nx = 3,
                    .ny = 2};
  const auto unseen = static_cast<float>(map.prior_log_odds());
  map.log_odds = {-1000.0f, unseen, 8.0f, 0.25f, -1.0f, unseen + 0.01f};
  return map;
}

auto fields_of(const OccupancyGrid& map) {
  return std::tuple(map.label, map.cell_mm, map.origin_mm.x, map.origin_mm.y, map.prior,
                    map.symmetry, map.spread_mm, map.suggested_symmetry, map.mirror, map.nx, map.ny,
                    map.log_odds, map.observations, map.mean_level);
}

class MapFile : public OneFile {
 protected:
  std::string message(const FileParts& parts) const {
    parts.save(path_);
    return refusal([&] { read_map(path_); });
  }

 private:
  HostLocale locale_;  // which changes no file
};

TEST_F(MapFile, ComesBackAsItWasWrittenWithWhatItMayHold) {
  OccupancyGrid written = small_map();
  for (const bool whole : {false, true}) {
    if (whole) {
      written.mirror = true;
      written.observations = {0.0F, 1.0F, 2.0F, 3.5F, 4.0F, 5.0F};
      written.mean_level = {0.0F, 10.0F, 20.0F, 30.0F, 40.0F, 255.0F};
    }
    write_map(path_, written);
    EXPECT_EQ(read_format(path_), "palpate.map");
    EXPECT_EQ(fields_of(read_map(path_)), fields_of(written));
  }
  map_parts().save(path_);
  const OccupancyGrid bare = read_map(path_);
  EXPECT_FALSE(bare.spread_mm || bare.suggested_symmetry || bare.mirror);
  write_map(path_, bare);
  EXPECT_FALSE(read_map(path_).spread_mm);
}

// FaultOfAMap has the values that no map may have.
TEST_F(MapFile, NamesAttributesItCannotTake) {
  const auto spoilt = [&](const char* name, auto value) {
    return message(map_parts().attribute(name, value));
  };
  for (const char* name : {"cell_mm", "spread_mm", "prior"}) {
    expect_named(spoilt(name, nan), {("'" + std::string(name) + "'").c_str()});
  }
  for (const double symmetry : {-1.0, 0.5, 1e12, nan}) {
    expect_named(spoilt("symmetry", symmetry), {"'symmetry'"});
    expect_named(spoilt("suggested_symmetry", symmetry), {"'suggested_symmetry'"});
  }
  expect_named(spoilt("origin_mm", std::vector<double>{0, nan}), {"'origin_mm'", "nan"});
  expect_named(spoilt("origin_mm", std::vector<double>{0, 0, 0}), {"'origin_mm'", "3", "2"});
  expect_named(spoilt("label", "(none)"), {"'label'", "(none)"});
  expect_named(spoilt("format", "palpate.recording"), {"a recording", "map"});
  for (const char* name :
       {"format", "version", "label", "cell_mm", "origin_mm", "prior", "symmetry"}) {
    expect_named(message(map_parts().without(name)), {"attribute", name, "missing"});
  }
}

TEST_F(MapFile, NamesCellsItCannotTake) {
  expect_named(message(map_parts().dataset("log_odds", {2, 3}, {0, 0, 0, 0, 0, nan})),
               {"'log_odds'[1, 2]", "nan"});
  // Finite in float64, infinite in the grid's float32.
  expect_named(message(map_parts().dataset("log_odds", {2, 3}, 1e300)), {"'log_odds'", "inf"});
  expect_named(message(map_parts().dataset("log_odds", {0, 3})), {"'log_odds'", "[0, 3]"});
  expect_named(message(map_parts().dataset("log_odds", {6})), {"'log_odds'", "dimensions"});
  expect_named(message(map_parts().without("log_odds")), {"'log_odds'", "missing"});
  expect_named(message(map_parts().dataset("observations", {3, 2})), {"'observations'", "[3, 2]"});
}

TEST_F(MapFile, IsNotWrittenWhereItCouldNotBeRead) {
  const auto spoilt = [&](auto OccupancyGrid::*field, const auto& value) {
    OccupancyGrid map = small_map();
    map.*field = value;
    return refusal([&] { write_map(path_, map); });
  };
  expect_named(spoilt(&OccupancyGrid::prior, 1.0), {"'prior'"});
  expect_named(spoilt(&OccupancyGrid::label, "\xc3"), {"'label'"});
  expect_named(spoilt(&OccupancyGrid::nx, 4), {"4 x 2"});
  expect_named(spoilt(&OccupancyGrid::observations, std::vector(5, 1.0F)), {"observations"});
  expect_named(spoilt(&OccupancyGrid::mean_level, std::vector{0.0F, 0.0F, 0.0F, -1.0F, 0.0F, 0.0F}),
               {"mean_level", "[1, 0]"});
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(MapFile, ShowsMapServerWhatIsOccupiedFreeAndUnknown) {
  write_map_server(folder_ / "A.yaml", small_map());
  // The upper row comes first: p = 0.56 unknown, 0.27 unknown, 0.10 free though barely seen; then
  // p = 0 free, unseen, nearly 1 occupied.
  const std::string pixels{'\xcd', '\xcd', '\xfe', '\xfe', '\xcd', '\x00'};
  EXPECT_EQ(bytes_of(folder_ / "A.pgm"), "P5\n3 2\n255\n" + pixels);
  EXPECT_EQ(bytes_of(folder_ / "A.yaml"),
            "image: A.pgm\nmode: trinary\nresolution: 0.0005\norigin: [-0.00375, 0.01175, 0]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
  input_error([&] { write_map_server(folder_ / "A.yaml", OccupancyGrid{.nx = 9, .ny = 9}); });
  expect_named(input_error([&] { write_map_server(folder_ / "A.pgm", small_map()); }),
               {"A.pgm", ".yaml"});
}

}  // namespace palpate::map_test
