// The lattice that recognize and live take where nobody gives one: about the first touch, over the
// region that the maps and the array make, in bins for the refined pose.

#include <cmath>
#include <numbers>

#include "letter_files.hpp"
#include "options/option.hpp"
#include "palpate/balanced_lattice.hpp"
#include "recognition/request.hpp"

namespace palpate::defaults_test {

using nlohmann::json;

/// Automatic bins are few: the maps' cells are twice as wide as usual, 1 mm.
class Defaults : public LetterFiles {
 protected:
  /// The record of the recording's unknown.
  json of(const std::string& recording, const std::string& flags = "") const {
    return record(recording + " --maps maps " + flags);
  }
  PoseLattice lattice_of(const std::string& recording, const std::string& flags) const {
    of(recording, flags + " --posterior p.h5");
    return read_posterior(folder_ / "p.h5").lattice;
  }
};

void expect_same_axes(const PoseLattice& a, const PoseLattice& b, double rounding) {
  for (const auto axis : {&PoseLattice::x_mm, &PoseLattice::y_mm, &PoseLattice::theta_rad}) {
    EXPECT_NEAR((a.*axis).lower, (b.*axis).lower, rounding);
    EXPECT_NEAR((a.*axis).upper, (b.*axis).upper, rounding);
    EXPECT_EQ((a.*axis).count, (b.*axis).count);
  }
}

/// Expects the same but for rounding.
void expect_like(const json& a, const json& b, double identity, double pose) {
  EXPECT_EQ(a["best"], b["best"]);
  for (const char* label : {"A", "I"}) {
    EXPECT_NEAR(a["identity"][label].get<double>(), b["identity"][label].get<double>(), identity);
  }
  for (const char* field : {"x_mm", "y_mm", "theta_rad"}) {
    EXPECT_NEAR(a["refined"][field].get<double>(), b["refined"][field].get<double>(), pose);
  }
}

TEST_F(Defaults, FollowTheMapsTheArrayAndTheFirstTouch) {
  const PoseLattice lattice = lattice_of("u.h5", "");
  EXPECT_EQ(lattice.pivot_mm, unknown_.T_robot_sensor.front().translation_mm);
  const std::vector<Hypothesis> hypotheses{{.map = sample_map("A")}, {.map = sample_map("I")}};
  const TouchRegion region = touch_region(hypotheses, array_reach_mm(digitacts_array()));
  expect_same_axes(lattice, balanced_lattice(region.lattice, hypotheses).lattice, 0.0);
}

TEST_F(Defaults, FindAnObjectFarFromTheRobotsOrigin) {
  // T_object_robot of an A whose origin lies at (400, 200) in the robot frame, turned by 40
  // degrees.
  const Pose T_object_robot = inverse(Pose{{400.0, 200.0}, 40.0 * std::numbers::pi / 180.0});
  write_recording(folder_ / "far.h5", sample_unknown("A", T_object_robot, 9));
  const json far = of("far.h5");
  EXPECT_EQ(far["right"], true);
  // Bins of 0.6 mm; the maps are ideal and the touches are not.
  EXPECT_LT(far["refined_error_mm"].get<double>(), 0.6);
  const json particles = of("far.h5", "--filter particles");
  EXPECT_EQ(particles["right"], true);
  // Motion noise of 1 mm and 0.1 rad at every touch.
  EXPECT_LT(particles["error_mm"].get<double>(), 3.0);
  EXPECT_EQ(of("far.h5", "--pivot-mm=0,0")["mode"]["map"].is_string(), true);
}

// Elements and poses of a frame 100 mm beside the array, such as the robot's flange.
TEST_F(Defaults, AreTheSameInAnySensorFrame) {
  const glm::dvec2 offset_mm{100.0, 0.0};
  const PoseLattice lattice = lattice_of("u.h5", "--filter=bounded");
  for (Pose& pose : unknown_.T_robot_sensor) {
    pose = pose * Pose{-offset_mm, 0.0};
  }
  for (glm::dvec2& element_mm : unknown_.elements_mm) {
    element_mm += offset_mm;
  }
  write_recording(folder_ / "flange.h5", unknown_);
  const PoseLattice about_flange = lattice_of("flange.h5", "--filter=bounded");
  EXPECT_NEAR(about_flange.pivot_mm.x, lattice.pivot_mm.x, 1e-9);
  EXPECT_NEAR(about_flange.pivot_mm.y, lattice.pivot_mm.y, 1e-9);
  expect_same_axes(about_flange, lattice, 1e-9);
  // Places relative to the pivot differ by the rounding of 100 mm, 1e-14 mm.
  expect_like(of("flange.h5", "--filter=bounded"), of("u.h5", "--filter=bounded"), 1e-6, 1e-4);
}

TEST(DefaultLattice, GivesWayTogetherToAnyPartOfALattice) {
  for (const std::map<std::string, std::string>& automatic :
       {std::map<std::string, std::string>{},
        {{"bins", "auto"}},
        {{"bins", "fine"}},
        {{"pivot-mm", "auto"}},
        {{"bins", "auto"}, {"pivot-mm", "auto"}}}) {
    EXPECT_TRUE(infers_region(request_with(automatic)));
  }
  constexpr double circle = 2.0 * std::numbers::pi;
  for (const auto& [name, text, expected] :
       std::initializer_list<std::tuple<const char*, const char*, PoseLattice>>{
           {"bins", "9x8x7", {{-10, 10, 9}, {-10, 10, 8}, {0, circle, 7}, {}}},
           {"x-mm", "-4:9", {{-4, 9, 25}, {-10, 10, 25}, {0, circle, 16}, {}}},
           {"y-mm", "-4:9", {{-10, 10, 25}, {-4, 9, 25}, {0, circle, 16}, {}}},
           {"theta-deg", "0:90", {{-10, 10, 25}, {-10, 10, 25}, {0, circle / 4, 16}, {}}},
           {"pivot-mm", "3,-2", {{-10, 10, 25}, {-10, 10, 25}, {0, circle, 16}, {3, -2}}},
           {"pivot-mm", "0,0", {{-10, 10, 25}, {-10, 10, 25}, {0, circle, 16}, {0, 0}}}}) {
    SCOPED_TRACE(std::string(name) + " " + text);
    const Request request = request_with({{name, text}});
    EXPECT_FALSE(infers_region(request));
    expect_same_axes(given_lattice(request), expected, 0.0);
    EXPECT_EQ(given_lattice(request).pivot_mm, expected.pivot_mm);
  }
}

TEST_F(Defaults, FineBinsAreHalfAsWide) {
  const PoseLattice usual = lattice_of("u.h5", "--touches=1 --filter=bounded");
  const PoseLattice fine = lattice_of("u.h5", "--touches=1 --filter=bounded --bins=fine");
  EXPECT_EQ(fine.x_mm.lower, usual.x_mm.lower);
  EXPECT_EQ(fine.pivot_mm, usual.pivot_mm);
  // Counts round up.
  EXPECT_NEAR(fine.x_mm.count, 2 * usual.x_mm.count, 2);
  EXPECT_NEAR(fine.theta_rad.count, 2 * usual.theta_rad.count, 2);
}

TEST_F(Defaults, TellOfObjectsFarApartInTheirFrames) {
  const char* recognize = "recognize u.h5 --maps maps --json r.json";
  EXPECT_EQ(remarks(recognize), "");
  OccupancyGrid far = sample_map("I");
  far.origin_mm.x += 60.0;
  write_map(folder_ / "maps/I.map.h5", far);
  expect_named(remarks(recognize), {"far apart", "--x-mm"});
  EXPECT_EQ(json::parse(bytes_of(folder_ / "r.json"))[0]["best"], "A");
}

TEST_F(Defaults, RefuseAFirstTouchBeyondEveryRobot) {
  unknown_.T_robot_sensor.front().translation_mm.x = 1e10;
  write_recording(folder_ / "beyond.h5", unknown_);
  expect_refused("recognize beyond.h5 --maps maps",
                 {"beyond.h5", "first touch", "10000000000", "poses' unit"});
}

}  // namespace palpate::defaults_test
