#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/hdf5_contents.hpp"
#include "palpate/files.hpp"
#include "palpate/simulation.hpp"
#include "support/program.hpp"

namespace palpate::simulate_test {

class SimulateCommand : public ProgramTest {
 protected:
  Recording simulate(const std::string& file, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "simulate");
    arguments.insert(arguments.end(), {"-o", file});
    EXPECT_NE(done(arguments).find(file), std::string::npos);
    return read_recording(folder_ / file);
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
  const Recording recording = simulate("A.h5", {"A"});
  EXPECT_EQ(recording.object, "A");
  EXPECT_EQ(recording.pressure_unit, "kPa");
  EXPECT_EQ(recording.rows, "touches");
  EXPECT_EQ(recording.elements_mm.size(), 36u);
  EXPECT_FALSE(recording.truth);
  const std::vector<Pose> grid = training_grid();
  ASSERT_EQ(recording.size(), 192u);
  for (std::size_t i = 0; i < grid.size(); ++i) {
    EXPECT_TRUE(same_pose(recording.T_robot_sensor[i], grid[i])) << i;
  }
}

// A file may have any name; a label is printable.
TEST_F(SimulateCommand, PolygonFileWithAnOddNameGivesAPrintableLabel) {
  for (const auto& [name, label] : {std::pair{"caf\xe9.txt", "caf?"}, {"a\nb.txt", "a?b"}}) {
    put_bytes(folder_ / name, "-10 -10\n10 -10\n0 10\n");
    EXPECT_EQ(simulate("p.h5", {name, "--touches", "2"}).object, label);
    EXPECT_EQ(simulate("u.h5", {name, "--touches", "2", "--object-pose", "1,2,3"}).truth->object,
              label);
  }
}

TEST_F(SimulateCommand, FileSaysWhatItIs) {
  simulate("A.h5", {"A"});
  const Hdf5Contents file(folder_ / "A.h5", {"format", "version", "length_unit"}, {});
  EXPECT_EQ(file.text("format"), "palpate.recording");
  EXPECT_EQ(file.integer("version", 0), 1);
  EXPECT_EQ(file.text("length_unit"), "mm");
}

TEST_F(SimulateCommand, UnknownHoldsItsTruthAndIsTouchedThere) {
  const Recording recording =
      simulate("u.h5", {"E", "--object-pose", "3,-4,30", "--touches", "20"});
  EXPECT_EQ(recording.object, "");
  ASSERT_TRUE(recording.truth);
  EXPECT_EQ(recording.truth->object, "E");
  const Pose& T_object_robot = recording.truth->T_object_robot;
  EXPECT_TRUE(same_pose(T_object_robot, {{3.0, -4.0}, std::numbers::pi / 6}));
  ASSERT_EQ(recording.size(), 20u);
  // Each touch is one of the grid's, none is drawn twice.
  std::vector<Pose> grid = training_grid();
  for (const Pose& T_robot_sensor : recording.T_robot_sensor) {
    const auto drawn = std::find_if(grid.begin(), grid.end(), [&](const Pose& T_object_sensor) {
      return same_pose(T_object_robot * T_robot_sensor, T_object_sensor);
    });
    ASSERT_NE(drawn, grid.end());
    grid.erase(drawn);
  }
}

TEST_F(SimulateCommand, RandomPoseIsWithinThePapersRange) {
  const Recording first = simulate("a.h5", {"A", "--object-pose", "random"});
  const Recording second = simulate("b.h5", {"A", "--object-pose", "random", "--seed", "2"});
  ASSERT_TRUE(first.truth && second.truth);
  for (const Pose& pose : {first.truth->T_object_robot, second.truth->T_object_robot}) {
    EXPECT_LE(std::abs(pose.translation_mm.x), 10.0);
    EXPECT_LE(std::abs(pose.translation_mm.y), 10.0);
  }
  EXPECT_FALSE(same_pose(first.truth->T_object_robot, second.truth->T_object_robot));
}

TEST_F(SimulateCommand, TouchesWithoutReplacementAlsoOfAKnownObject) {
  const Recording recording = simulate("A.h5", {"A", "--touches", "7"});
  EXPECT_EQ(recording.size(), 7u);
  EXPECT_EQ(recording.object, "A");
}

TEST_F(SimulateCommand, RandomPosesAreAsManyAsAskedFor) {
  EXPECT_EQ(simulate("A.h5", {"A", "--poses", "random:17"}).size(), 17u);
}

TEST_F(SimulateCommand, SameSeedGivesTheSameFile) {
  const std::vector<std::string> arguments{"A", "--object-pose", "random", "--touches", "5"};
  simulate("a.h5", arguments);
  simulate("b.h5", arguments);
  EXPECT_TRUE(bytes_of(folder_ / "a.h5") == bytes_of(folder_ / "b.h5"));
  simulate("c.h5", {"A", "--object-pose", "random", "--touches", "5", "--seed", "2"});
  EXPECT_FALSE(bytes_of(folder_ / "a.h5") == bytes_of(folder_ / "c.h5"));
}

TEST_F(SimulateCommand, DefaultsAreTheDocumentedOnes) {
  simulate("a.h5", {"A"});
  simulate("b.h5",
           {"A", "--seed", "1", "--poses", "grid", "--psf-mm", "1.0", "--noise-kpa", "0.7"});
  EXPECT_TRUE(bytes_of(folder_ / "a.h5") == bytes_of(folder_ / "b.h5"));
}

TEST_F(SimulateCommand, NoiseAndPointSpreadMatter) {
  const auto silent = [](const Recording& recording) {
    return std::count(recording.pressure.begin(), recording.pressure.end(), 0.0);
  };
  const auto quiet = silent(simulate("a.h5", {"A", "--noise-kpa", "0", "--psf-mm", "0.1"}));
  const auto blurred = silent(simulate("b.h5", {"A", "--noise-kpa", "0", "--psf-mm", "3"}));
  // Without noise an element off the letter reads nothing, unless the point spread reaches it.
  EXPECT_GT(quiet, blurred);
  EXPECT_GT(quiet, 0);
}

TEST_F(SimulateCommand, PolygonFileIsAShape) {
  put_bytes(folder_ / "tile.txt", "# a square\n-8 -8\n8 -8\n8 8\n-8 8\n");
  EXPECT_EQ(simulate("t.h5", {"tile.txt", "--touches", "3"}).object, "tile");
}

}  // namespace palpate::simulate_test
