// What touches that a map has not seen are like.

#include "estimation/maps/left_out_fit.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/files.hpp"
#include "palpate/simulation.hpp"

namespace palpate::left_out_fit_test {

class LeftOutFit : public testing::Test {
 protected:
  static Recording touches(std::size_t count, std::uint64_t seed) {
    Simulator simulator(make_shape("E"), {}, digitacts_array(), 5);
    Recording recording = simulator.touch(random_poses(count, seed), {});
    recording.object = "E";
    return recording;
  }

  FitScale scale(const Recording& recording) {
    return left_out_fit(device_, {recording, MapOptions()}).value();
  }

  Device device_ = Device::open();
};

TEST_F(LeftOutFit, IsThatOfTouchesToCome) {
  const Recording learned = touches(150, 1);
  MapBuilder builder(device_, MapOptions());
  builder.add(learned.touches(0, learned.size()));
  const OccupancyGrid map = builder.build("E");
  std::vector<double> z;
  const Recording others = touches(100, 2);
  for (const Touch& touch : others.touches(0, 100)) {
    z.push_back(fit_of(std::span(&touch, 1), Pose{}, map, ContactModel{})->z);
  }
  const FitScale to_come = scale_of(z).value();
  const FitScale told = scale(learned);
  // Three standard errors; a quarter less touches makes the maps a little worse, too.
  EXPECT_NEAR(told.mean, to_come.mean, 3.0 * told.sd * std::sqrt(1.0 / 150 + 1.0 / 100) + 0.03);
  EXPECT_NEAR(told.sd / to_come.sd, 1.0, 0.5) << "rare touches make most of it";
}

TEST_F(LeftOutFit, IsWorseWhereTouchesContradict) {
  const Recording sound = touches(60, 1);
  Recording off = sound;
  for (std::size_t i = 0; i < off.size(); i += 2) {
    off.T_robot_sensor[i].translation_mm.x += 3.0;
  }
  EXPECT_LT(scale(off).mean, scale(sound).mean - 0.5);
  EXPECT_GT(scale(off).sd, scale(sound).sd);
}

TEST_F(LeftOutFit, NeedsSixteenTouchesInContact) {
  Recording few = touches(40, 1);
  std::fill_n(few.pressure.begin(), 25 * few.elements(), 0.0);
  EXPECT_FALSE(left_out_fit(device_, {few, MapOptions()}));
}

TEST_F(LeftOutFit, IsKeptInTheMapsFile) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / "left_out_fit_test.map.h5";
  const Recording learned = touches(40, 1);
  MapBuilder builder(device_, MapOptions());
  builder.add(learned.touches(0, learned.size()));
  OccupancyGrid map = builder.build("E");
  for (const auto& left_out : {std::optional<FitScale>{}, left_out_fit(device_, {learned, {}})}) {
    MapSource source{learned, MapOptions(), left_out};
    map.source = std::make_shared<const MapSource>(std::move(source));
    write_map(file, map);
    const auto read = read_map(file).source->left_out;
    ASSERT_EQ(read.has_value(), left_out.has_value());
    EXPECT_TRUE(!read || (read->mean == left_out->mean && read->sd == left_out->sd));
    EXPECT_EQ(with_prior(device_, map, 0.3).source->left_out.has_value(), left_out.has_value());
  }
  std::filesystem::remove(file);
}

}  // namespace palpate::left_out_fit_test
