// Poses in space that palpate import takes into the plane of the touches.

#include <numbers>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>

#include "import_command.hpp"

namespace palpate::import_space_test {

const glm::dquat no_turn(1.0, 0.0, 0.0, 0.0);

/// Poses in space, of an array 100 mm above the robot's xy plane whose frame the 2D poses have,
/// taken on by `turn`.
std::string spatial_poses(const std::vector<Pose>& poses, const glm::dquat& turn, double tilt_rad) {
  std::string table = "time,tx,ty,tz,qx,qy,qz,qw\n";
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const glm::dvec3 p = turn * glm::dvec3(poses[i].translation_mm, 100.0);
    const glm::dquat q = turn * glm::angleAxis(poses[i].theta_rad, glm::dvec3(0.0, 0.0, 1.0)) *
                         glm::angleAxis(tilt_rad, glm::dvec3(1.0, 0.0, 0.0));
    table += fmt::format("{},{},{},{},{},{},{},{}\n", 0.05 * static_cast<double>(i), p.x, p.y, p.z,
                         q.x, q.y, q.z, q.w);
  }
  return table;
}

class ImportInSpace : public ImportCommand {
 protected:
  ImportInSpace() { put("array.csv", "x,y\n-1,0.5\n1,-0.25\n"); }

  const std::string in_mm_ = "--poses poses.csv --pose-unit mm,rad ";
};

TEST_F(ImportInSpace, PosesLieInThePlaneOfTheTouches) {
  const std::vector<Pose> poses{{{1.0, 2.0}, 0.5}, {{-3.0, 4.0}, -2.0}, {{6.0, -5.0}, 3.0}};
  const glm::dquat upright = glm::angleAxis(std::numbers::pi / 2.0, glm::dvec3(1.0, 0.0, 0.0));
  for (const auto& [down, turn] :
       {std::pair{false, no_turn}, {false, upright}, {true, no_turn}, {true, upright}}) {
    SCOPED_TRACE(fmt::format("{}, {}", down, turn.w));
    put("poses.csv", spatial_poses(poses, turn, down ? std::numbers::pi : 0.0));
    const std::string said = warned(in_mm_ + "--array array.csv");
    const Recording recording = read_recording(folder_ / "o.h5");
    // In an upright plane, whose normal is the robot's y, x is still the robot's and y its -z.
    const double side = turn == no_turn ? 1.0 : -1.0;
    const bool faces_away = down == (side > 0.0);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Pose& pose = recording.T_robot_sensor[i];
      EXPECT_NEAR(pose.translation_mm.x, poses[i].translation_mm.x, 1e-9);
      EXPECT_NEAR(pose.translation_mm.y, side * poses[i].translation_mm.y, 1e-9);
      EXPECT_NEAR(wrap_angle(pose.theta_rad - side * poses[i].theta_rad, 2.0 * std::numbers::pi),
                  0.0, 1e-9);
    }
    EXPECT_EQ(recording.elements_mm[0], glm::dvec2(-1.0, faces_away ? -0.5 : 0.5));
    EXPECT_EQ(recording.elements_mm[1], glm::dvec2(1.0, faces_away ? 0.25 : -0.25));
    EXPECT_EQ(said.find("y is turned over") != said.npos, faces_away) << said;
    const char* along = "x and y are along (1, 0, 0) and (0, 0, -1) of the robot frame";
    EXPECT_EQ(said.find(along) != said.npos, side < 0.0) << said;
    EXPECT_EQ(said.find("tilted"), said.npos) << said;
  }
}

TEST_F(ImportInSpace, AGivenPlaneNeedsNoLikeDirections) {
  // The array looks up once, and down twice: it is turned over.
  put("poses.csv",
      "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n0.05,1,2,0,1,0,0,0\n0.1,1,2,0,1,0,0,0\n");
  warned(in_mm_ + "--array array.csv --plane 0,0,1");
  const Recording recording = read_recording(folder_ / "o.h5");
  EXPECT_EQ(recording.elements_mm[0], glm::dvec2(-1.0, -0.5));
  EXPECT_EQ(recording.T_robot_sensor[1].translation_mm, glm::dvec2(1.0, 2.0));
}

TEST_F(ImportInSpace, TiltAndHeightUnderLoadAreSaid) {
  const std::vector<Pose> poses(3);
  put("poses.csv", spatial_poses(poses, no_turn, 0.2));
  expect_named(warned("--poses poses.csv --plane 0,0,2"),
               {"poses.csv: 2 of 2 poses under load are tilted by more than 3 degrees, 11.5 at "
                "most: press the array flat, or give the --plane"});
  const std::vector<SetupFinding> findings = read_recording(folder_ / "o.h5").findings;
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].what, "tilt");
  EXPECT_EQ(findings[0].nats, 0.0);
  // Only the last two frames are pressed: the first pose's height does not count.
  std::string table = spatial_poses(poses, no_turn, 0.0);
  table.replace(table.find("100"), 3, "190");
  put("poses.csv", table);
  EXPECT_EQ(warned("--poses poses.csv"), "");
  put("log.csv", "time,p0,p1\n-0.05,1,2\n0,3,4\n0.05,5,6\n");  // its clock is 0.05 s behind
  EXPECT_NE(warned("--poses poses.csv"), "");
  EXPECT_EQ(warned("--poses poses.csv --pose-delay 0.05"), "");
  put("log.csv", frames);
  table.replace(table.rfind("100"), 3, "103");
  put("poses.csv", table);
  EXPECT_EQ(warned("--poses poses.csv"),
            "palpate: poses.csv: the height under load varies by 3.0 mm: do all touches lie in one "
            "plane?\n");
}

TEST_F(ImportInSpace, OtherTablesOfPosesAreRead) {
  put("poses.csv", "time,x,y,z,roll,yaw\n0,1,2,30,0.01,0.5\n1,1,2,30,6.29,0.5\n");
  expect_named(warned(in_mm_), {"poses.csv: its column 'z' was left out"});
  // Without a header the number of columns tells.
  put("poses.csv", "0 1 2 3 0 0 0 1\n0.1 2 3 3 0 0 0.479425538604203 0.8775825618903728\n");
  const Recording recording = imported("--poses poses.csv --pose-unit m,rad");
  EXPECT_EQ(recording.T_robot_sensor.front().translation_mm, glm::dvec2(1000.0, 2000.0));
  EXPECT_NEAR(recording.T_robot_sensor.back().theta_rad, 1.0, 1e-12);
}

}  // namespace palpate::import_space_test
