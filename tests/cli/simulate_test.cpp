#include <algorithm>
#include <cmath>
#include <numbers>

#include "palpate/files.hpp"
#include "palpate/simulation.hpp"
#include "support/program.hpp"

namespace palpate::simulate_test {

class SimulateCommand : public ProgramTest {
 protected:
  Recording simulate(const std::string& flags) const {
    expect_named(done("simulate -o s.h5 " + flags), {"s.h5"});
    return read_recording(folder_ / "s.h5");
  }
  std::string bytes(const std::string& flags) const {
    simulate(flags);
    return bytes_of(folder_ / "s.h5");
  }
};

bool same_pose(const Pose& a, const Pose& b) {
  // Inverting and multiplying poses rounds off so much, in millimetres and radians.
  constexpr double rounding = 1e-9;
  return std::abs(a.translation_mm.x - b.translation_mm.x) < rounding &&
         std::abs(a.translation_mm.y - b.translation_mm.y) < rounding &&
         std::abs(wrap_angle(a.theta_rad - b.theta_rad)) < rounding;
}

TEST_F(SimulateCommand, GridTouchesAKnownObject) {
  const Recording recording = simulate("A");
  EXPECT_EQ(recording.object, "A");
  EXPECT_EQ(recording.elements_mm, digitacts_array());
  EXPECT_FALSE(recording.truth);
  const std::vector<Pose> grid = training_grid();
  ASSERT_EQ(recording.size(), 192u);
  for (std::size_t i = 0; i < grid.size(); ++i) {
    EXPECT_TRUE(same_pose(recording.T_robot_sensor[i], grid[i])) << i;
  }
}

// A file may have any name; a label is printable.
TEST_F(SimulateCommand, PolygonFilesAreShapesOfAPrintableLabel) {
  for (const auto& [name, label] : {std::pair<std::string, std::string>{"tile.txt", "tile"},
                                    {"caf\xe9.txt", "caf?"},
                                    {"a\nb.txt", "a?b"}}) {
    put_bytes(folder_ / name, "# a triangle\n-10 -10\n10 -10\n0 10\n");
    done({"simulate", name, "-o", "s.h5", "--touches", "2"});
    EXPECT_EQ(read_recording(folder_ / "s.h5").object, label);
    done({"simulate", name, "-o", "s.h5", "--touches", "2", "--object-pose", "1,2,3"});
    EXPECT_EQ(read_recording(folder_ / "s.h5").truth->object, label);
  }
}

TEST_F(SimulateCommand, UnknownHoldsItsTruthAndIsTouchedThere) {
  const Recording recording = simulate("E --object-pose 3,-4,30 --touches 20");
  EXPECT_EQ(recording.object, "");
  EXPECT_EQ(recording.truth.value().object, "E");
  const Pose& T_object_robot = recording.truth->T_object_robot;
  EXPECT_TRUE(same_pose(T_object_robot, {{3.0, -4.0}, std::numbers::pi / 6}));
  ASSERT_EQ(recording.size(), 20u);
  // Each touch is one of the grid's, none is drawn twice.
  std::vector<Pose> grid = training_grid();
  for (const Pose& T_robot_sensor : recording.T_robot_sensor) {
    const auto drawn = std::ranges::find_if(grid, [&](const Pose& T_object_sensor) {
      return same_pose(T_object_robot * T_robot_sensor, T_object_sensor);
    });
    ASSERT_NE(drawn, grid.end());
    grid.erase(drawn);
  }
  const Recording known = simulate("A --touches 7");
  EXPECT_EQ(known.size(), 7u);
  EXPECT_EQ(known.object, "A");
}

TEST_F(SimulateCommand, RandomPosesAreOfTheSeed) {
  EXPECT_TRUE(same_pose(simulate("A --object-pose random --seed 2").truth.value().T_object_robot,
                        random_object_pose(2)));
  EXPECT_EQ(simulate("A --poses random:17").size(), 17u);
  const std::string flags = "A --object-pose random --touches 5";
  EXPECT_TRUE(bytes(flags) == bytes(flags));
  EXPECT_FALSE(bytes(flags) == bytes(flags + " --seed 2"));
  EXPECT_TRUE(bytes("A") == bytes("A --seed 1 --poses grid --psf-mm 1.0 --noise-kpa 0.7"))
      << "the documented defaults";
  // Without noise an element off the letter reads nothing, unless the point spread reaches it.
  const auto silent = [&](const std::string& psf_mm) {
    return std::ranges::count(simulate("A --noise-kpa 0 --psf-mm " + psf_mm).pressure, 0.0);
  };
  EXPECT_GT(silent("0.1"), silent("3"));
}

}  // namespace palpate::simulate_test
