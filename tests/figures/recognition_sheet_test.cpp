// The sheet of a recognition, and the belief that it shows.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "figures/figures.hpp"
#include "figures/placed_belief.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/touch.hpp"
#include "picture.hpp"
#include "support/limits.hpp"

namespace palpate::recognition_sheet_test {

/// A bar from (-5, 0) to (6, 1), touched twice at a pivot far from the robot's origin.
RecognitionSheet example() {
  RecognitionSheet sheet;
  sheet.title = "bar.h5";
  sheet.result = "bar (90.0 %): x 9.44 ± 0.28 mm, y 0.42 ± 0.27 mm, theta 47.72 ± 1.60°";
  sheet.captions = {{"truth: bar at x 9.59 mm, y 0.39 mm, theta 48.00°; error 0.5 mm"}};
  sheet.map = {.label = "bar", .origin_mm = {-10.0, -10.0}, .nx = 41, .ny = 41, .log_odds = {}};
  for (int j = 0; j < sheet.map.ny; ++j) {
    for (int i = 0; i < sheet.map.nx; ++i) {
      const bool on = i >= 10 && i <= 32 && j >= 20 && j <= 22;
      sheet.map.log_odds.push_back(on ? 8.0F : -4.0F);
    }
  }
  sheet.T_object_robot = inverse(Pose{{200.0, -50.0}, -0.3});
  sheet.truth = inverse(Pose{{200.4, -50.3}, -0.35});
  for (const Pose& T_robot_sensor : {Pose{{198.0, -49.0}, 0.1}, Pose{{204.0, -52.0}, 1.0}}) {
    std::vector<glm::dvec2> elements = digitacts_array();
    for (glm::dvec2& p : elements) {
      p = T_robot_sensor * p;
    }
    sheet.footprints_mm.push_back(elements);
  }
  sheet.belief = {.lower_mm = {195.0, -55.0}, .cell_mm = 0.4, .cells = 25};
  sheet.belief.xy.assign(25 * 25, 1e-9);
  sheet.belief.xy[15 * 25 + 4] = 0.8;
  sheet.modes = {
      {"bar 90.0 %", {{{200.0, -50.0}, -0.3}, {0.04, 0, 0, 0, 0.09, 0, 0, 0, 1e-3}}, true},
      {"ring 8.0 %", {{{190.0, -45.0}, 0.0}, {0.5, 0.2, 0, 0.2, 0.5, 0, 0, 0, 1e-3}}}};
  sheet.labels = {"bar", "ring"};
  sheet.identity = {{0.6, 0.4}, {0.9, 0.1}};
  return sheet;
}

/// Pixels of exactly this colour.
int count(const Picture& picture, const Colour& colour) {
  return static_cast<int>(std::ranges::count(picture.pixels, rgb(colour)));
}

Picture drawn(const RecognitionSheet& sheet) { return decode(draw_recognition(sheet)); }

const Picture& drawn_example() {
  static const Picture picture = drawn(example());
  return picture;
}

TEST(RecognitionSheet, HasOneSizeWhateverItShows) {
  EXPECT_GE(drawn_example().width, 2000);
  const std::pair<const char*, void (*)(RecognitionSheet&)> changes[] = {
      {"nothing but a map and a belief",
       [](RecognitionSheet& sheet) {
         sheet.footprints_mm.clear();
         sheet.truth.reset();
         sheet.result.clear();
         sheet.captions.clear();
         sheet.identity.clear();
         sheet.labels.clear();
       }},
      {"one touch and cells of one",
       [](RecognitionSheet& sheet) {
         sheet.map = {.label = "dot", .nx = 1, .ny = 1, .log_odds = {2.0F}};
         sheet.belief = {.cells = 1, .xy = {1.0}};
         sheet.footprints_mm.resize(1);
         sheet.identity.resize(1);
       }},
      {"poses outside of the belief",
       [](RecognitionSheet& sheet) {
         sheet.T_object_robot = inverse(Pose{{-300.0, -3.0}, 0.0});
         sheet.truth = inverse(Pose{{0.0, 2000.0}, 0.0});
       }},
      {"a belief of no number", [](RecognitionSheet& sheet) {
         sheet.belief.xy.assign(sheet.belief.xy.size(), nan);
         sheet.identity = {{0.5, 0.5}, {nan, nan}};
       }}};
  for (const auto& [name, change] : changes) {
    RecognitionSheet sheet = example();
    change(sheet);
    const Picture picture = drawn(sheet);
    EXPECT_EQ(picture.width, drawn_example().width) << name;
    EXPECT_EQ(picture.height, drawn_example().height) << name;
  }
}

TEST(RecognitionSheet, ShowsTheBeliefsLargestBinInTheBrightestColours) {
  RecognitionSheet sheet = example();
  sheet.T_object_robot = inverse(Pose{{204.0, -46.0}, 0.3});
  sheet.truth.reset();
  sheet.modes.clear();
  // log10 0.8 = -0.097 on the scale of six powers of ten below 1.
  const Colour peak = sequential((std::log10(0.8) + 6.0) / 6.0);
  const int with = count(drawn(sheet), peak);
  sheet.belief.xy[15 * 25 + 4] = 1e-9;
  sheet.belief.xy[0] = 0.7;  // keeps the scale
  const int without = count(drawn(sheet), peak);
  // A bin is 480 / 25 = 19.2 pixels wide.
  EXPECT_NEAR(with - without, 19.2 * 19.2, 2 * 19.2);
  sheet.belief.xy.assign(sheet.belief.xy.size(), 0.0);
  EXPECT_GE(count(drawn(sheet), sequential(0.0)), 400 * 400) << "no mass is the dark end";
}

TEST(RecognitionSheet, DrawsEveryMode) {
  RecognitionSheet sheet = example();
  const Picture& both = drawn_example();
  sheet.modes.pop_back();
  const Picture own = drawn(sheet);
  sheet.modes.clear();
  const Picture none = drawn(sheet);
  const Difference other = difference(both, own);
  EXPECT_GT(other.pixels, 100);
  EXPECT_LT(other.right, both.width / 3) << "the belief is of the estimated object";
  EXPECT_GT(difference(own, none).right, both.width / 3);
}

TEST(RecognitionSheet, DrawsTheTruthNearestToTheEstimateUnderTheSymmetry) {
  RecognitionSheet sheet = example();
  const glm::dvec2 c = body_of(sheet.map).centroid_mm;
  const auto turned = [&](double angle_rad) {
    return Pose{c - rotate(angle_rad, c), angle_rad} * *example().truth;
  };
  sheet.map.symmetry = 2;
  const Picture plain = drawn(sheet);
  const Difference legends = difference(drawn_example(), plain);
  EXPECT_GT(legends.pixels, 0);
  EXPECT_LT(legends.bottom, 256) << "the plots begin there: a truth that is the nearest stays";
  sheet.truth = turned(std::numbers::pi);
  EXPECT_LE(difference(plain, drawn(sheet)).pixels, 4) << "antialiasing alone";
  sheet.truth = turned(std::numbers::pi / 2);
  EXPECT_GT(difference(plain, drawn(sheet)).pixels, 100);

  sheet.map.symmetry = 0;
  const Picture full = drawn(sheet);
  sheet.truth = turned(1.234);
  EXPECT_LE(difference(full, drawn(sheet)).pixels, 4) << "antialiasing alone";
}

TEST(RecognitionSheet, CaptionsKeepToTheirPlaceHoweverLongAndSayWhatIsWrongInRed) {
  RecognitionSheet sheet = example();
  sheet.title = sheet.result = std::string(1000, 'W');
  sheet.captions.assign(9, {std::string(1000, 'W'), true});
  const Picture after = drawn(sheet);
  const Difference change = difference(drawn_example(), after);
  EXPECT_LT(change.bottom, 182) << "the panels' titles begin there";
  const Colour alarm{0.75, 0.1, 0.1};
  EXPECT_EQ(count(drawn_example(), alarm), 0);
  EXPECT_GT(count(after, alarm), 0);
  // The result leaves the title its room: between them, one column of the first row is white.
  bool apart = false;
  for (int x = after.width / 2; x < after.width - 100 && !apart; ++x) {
    apart = true;
    for (int y = 25; y < 60; ++y) {
      apart = apart && after.at(x, y) == 0xFFFFFF && after.at(x + 20, y) == 0xFFFFFF;
    }
  }
  EXPECT_TRUE(apart);
}

TEST(RecognitionSheet, AddsUpObjectsOfEqualLabel) {
  RecognitionSheet sheet = example();
  sheet.identity = {{0.5, 0.5}, {0.75, 0.25}};
  const std::string two = draw_recognition(sheet);
  sheet.labels = {"bar", "ring", "bar"};
  sheet.identity = {{0.25, 0.5, 0.25}, {0.5, 0.25, 0.25}};
  EXPECT_EQ(draw_recognition(sheet), two);
}

TEST(RecognitionSheet, DrawsManyLabelsAndTouchesInTheColoursOfTheSeries) {
  RecognitionSheet sheet = example();
  sheet.labels.clear();
  for (int k = 0; k < 40; ++k) {
    sheet.labels.push_back("object with a long label, number " + std::to_string(k));
  }
  sheet.identity.assign(100, std::vector<double>(40, 1.0 / 40));
  sheet.identity.back()[7] = nan;
  const Picture picture = drawn(sheet);
  EXPECT_GT(count(picture, grey), 0);
  for (std::size_t k = 0; k + 1 < series_colours; ++k) {
    EXPECT_GT(count(picture, series(k)), 0) << k;
  }
}

const PoseLattice lattice{
    {-10.0, 10.0, 40}, {-8.0, 8.0, 32}, {0.0, 2.0 * std::numbers::pi, 72}, {150.0, -40.0}};

/// Where a cell of the belief lies.
glm::dvec2 centre(const PlacedBelief& belief, std::size_t cell) {
  const auto across = static_cast<std::size_t>(belief.cells);
  return belief.lower_mm +
         belief.cell_mm * (glm::dvec2(cell % across, cell / across) + glm::dvec2(0.5));
}

TEST(PlacedBelief, ABinLiesWhereItsPoseHasTheObject) {
  for (const Pose& T_object_robot :
       {lattice.T_object_robot(0.25, 0.25, 0.04), lattice.T_object_robot(-7.25, 5.25, 3.9)}) {
    const BinShare bin{lattice.bin_of(T_object_robot), 1.0};
    const PlacedBelief belief = placed_belief(lattice, std::span(&bin, 1));
    const Pose expected = inverse(lattice.T_object_robot(bin.bin));
    glm::dvec2 mean{0.0};
    for (std::size_t cell = 0; cell < belief.xy.size(); ++cell) {
      mean += belief.xy[cell] * centre(belief, cell);
    }
    // The 27 parts of a bin lie on an arc of 5 degrees, and in cells of 0.5 mm.
    EXPECT_NEAR(mean.x, expected.translation_mm.x, 0.2);
    EXPECT_NEAR(mean.y, expected.translation_mm.y, 0.2);
    EXPECT_NEAR(std::accumulate(belief.xy.begin(), belief.xy.end(), 0.0), 1.0, 1e-12);
    const auto turn = std::ranges::max(belief.theta, {}, &PlacedBelief::ThetaShare::probability);
    EXPECT_NEAR(std::remainder(turn.theta_rad - expected.theta_rad, 2.0 * std::numbers::pi), 0.0,
                1e-12);
    EXPECT_TRUE(std::ranges::is_sorted(belief.theta, {}, &PlacedBelief::ThetaShare::theta_rad));
  }
}

TEST(PlacedBelief, TheWindowHoldsWhatMattersAndNoMoreInFewCells) {
  const std::int64_t near = lattice.bin_of(lattice.T_object_robot(0.25, 0.25, 0.04));
  const std::int64_t far = lattice.bin_of(lattice.T_object_robot(-9.0, -7.0, 0.04));
  const std::vector<BinShare> both{{near, 0.9}, {far, 0.1}};
  const PlacedBelief wide = placed_belief(lattice, both);
  EXPECT_GE(wide.cells * wide.cell_mm, 9.0);
  const std::vector<BinShare> hardly{{near, 0.99999}, {far, 0.00001}};
  const PlacedBelief narrow = placed_belief(lattice, hardly);
  EXPECT_LE(narrow.cells * narrow.cell_mm, 8.0);
  EXPECT_NEAR(narrow.cell_mm, 0.5, 1e-12) << "no finer than the lattice";
  PoseLattice large = lattice;
  large.x_mm = {-500.0, 500.0, 20000};
  large.y_mm = {-500.0, 500.0, 20000};
  const std::vector<BinShare> corners{{0, 0.5}, {large.plane() - 1, 0.5}};
  const PlacedBelief belief = placed_belief(large, corners);
  EXPECT_LE(belief.cells, 160);
  EXPECT_NEAR(std::accumulate(belief.xy.begin(), belief.xy.end(), 0.0), 1.0, 1e-12);
}

}  // namespace palpate::recognition_sheet_test
