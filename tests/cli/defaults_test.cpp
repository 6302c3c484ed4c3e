// The lattice that recognize and live take where nobody gives one: about the first touch, over the
// region that the maps and the array make, in bins for the refined pose. The posterior that
// recognize writes.

#include <algorithm>
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

void expect_same_axes(const PoseLattice& a, const PoseLattice& b) {
  for (const auto axis : {&PoseLattice::x_mm, &PoseLattice::y_mm, &PoseLattice::theta_rad}) {
    EXPECT_EQ((a.*axis).lower, (b.*axis).lower);
    EXPECT_EQ((a.*axis).upper, (b.*axis).upper);
    EXPECT_EQ((a.*axis).count, (b.*axis).count);
  }
}

TEST_F(Defaults, FollowTheMapsTheArrayAndTheFirstTouch) {
  const PoseLattice lattice = lattice_of("u.h5", "");
  EXPECT_EQ(lattice.pivot_mm, unknown_.T_robot_sensor.front().translation_mm);
  const std::vector<Hypothesis> hypotheses{{.map = sample_map("A")}, {.map = sample_map("I")}};
  const TouchRegion region = touch_region(hypotheses, array_reach_mm(digitacts_array()));
  expect_same_axes(lattice, balanced_lattice(region.lattice, hypotheses).lattice);
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
  for (const auto& [name, text] : {std::pair{"bins", "9x8x7"},
                                   {"x-mm", "-4:9"},
                                   {"y-mm", "-4:9"},
                                   {"theta-deg", "0:90"},
                                   {"pivot-mm", "3,-2"},
                                   {"pivot-mm", "0,0"}}) {
    EXPECT_FALSE(infers_region(request_with({{name, text}}))) << name << " " << text;
  }
  expect_same_axes(given_lattice(request_with({{"x-mm", "-4:9"}})),
                   {{-4, 9, 25}, {-10, 10, 25}, {0, 2.0 * std::numbers::pi, 16}, {}});
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

using RecognizePosterior = LetterFiles;

TEST_F(RecognizePosterior, IsTheRecordsSource) {
  const std::string u = "u.h5 --maps maps --touches=2 --bins=7x6x5 ";
  const nlohmann::json r = record(u + "--posterior=p.h5 --none=0");
  const Posterior p = read_posterior(folder_ / "p.h5");
  EXPECT_FALSE(p.rest_mass_bound) << "auto writes every bin";
  EXPECT_EQ(p.objects, (std::vector<std::string>{"A", "I"}));
  EXPECT_EQ(std::tuple(p.lattice.x_mm.count, p.lattice.y_mm.count, p.lattice.theta_rad.count),
            std::tuple(7, 6, 5));
  const auto bins = static_cast<std::size_t>(p.lattice.bins());
  ASSERT_EQ(p.log_likelihood.size(), 2 * bins);
  const auto most = std::max_element(p.log_likelihood.begin(), p.log_likelihood.end());
  const auto index = static_cast<std::size_t>(most - p.log_likelihood.begin());
  EXPECT_EQ(r["mode"]["object"], p.objects[index / bins]);
  const Pose T_object_robot = p.lattice.T_object_robot(static_cast<std::int64_t>(index % bins));
  EXPECT_DOUBLE_EQ(r["mode"]["x_mm"].get<double>(), T_object_robot.translation_mm.x);
  EXPECT_DOUBLE_EQ(r["mode"]["log_likelihood"].get<double>(), *most);

  for (const char* ask : {"--filter=bounded", "--tolerance=1e-3"}) {
    const nlohmann::json bounded = record(u + "--posterior=some.h5 " + ask);
    const Posterior some = read_posterior(folder_ / "some.h5");
    EXPECT_EQ(some.objects, p.objects);
    EXPECT_EQ(some.lattice.bins(), p.lattice.bins());
    EXPECT_EQ(some.index.size(), bounded["bins_evaluated"]);
    ASSERT_TRUE(some.rest_mass_bound);
    EXPECT_GE(*some.rest_mass_bound, bounded["dropped_mass"].get<double>());
    EXPECT_LT(*some.rest_mass_bound, 1e-3);
    for (std::size_t i = 0; i < some.index.size(); ++i) {
      EXPECT_NEAR(some.log_likelihood[i], p.log_likelihood[static_cast<std::size_t>(some.index[i])],
                  1e-3);
    }
  }
}

}  // namespace palpate::defaults_test
