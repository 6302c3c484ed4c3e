// palpate map on drawings.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <png.h>

#include "model/bounding_box.hpp"
#include "palpate/files.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::map_drawing_test {

using testing::HasSubstr;

// Whether a place of a picture is on the object; x to the right and y down from the upper left
// corner, mm.
using Shape = std::function<bool(double x, double y)>;

// A bar 20 mm wide and 4 mm high whose left end is 10 mm high: an L lying on its back.
bool part(double x, double y) {
  return x >= 5.0 && y < 15.0 && (y >= 11.0 ? x < 25.0 : y >= 5.0 && x < 9.0);
}
bool bar(double x, double y) { return x >= 5.0 && x < 25.0 && y >= 8.0 && y < 12.0; }
// The stroke of an I, 20.5 mm long and 4.5 mm wide with round ends, upright about (5, 15).
bool stroke(double x, double y) {
  return std::hypot(x - 5.0, y - std::clamp(y, 4.75, 25.25)) <= 2.25;
}

class MapDrawing : public ProgramTest {
 protected:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  /// A picture of a format of libpng, a pixel of `on` or `off` for each of pixel_mm.
  void write_png(const std::string& name, const Shape& shape, const glm::dvec2& size_mm = {30, 20},
                 double pixel_mm = 0.5, png_uint_32 format = PNG_FORMAT_GRAY,
                 const std::vector<png_byte>& on = {0},
                 const std::vector<png_byte>& off = {255}) const {
    const auto columns = static_cast<png_uint_32>(std::lround(size_mm.x / pixel_mm));
    const auto rows = static_cast<png_uint_32>(std::lround(size_mm.y / pixel_mm));
    std::vector<png_byte> pixels;
    for (png_uint_32 row = 0; row < rows; ++row) {
      for (png_uint_32 column = 0; column < columns; ++column) {
        const std::vector<png_byte>& pixel =
            shape(pixel_mm * (column + 0.5), pixel_mm * (row + 0.5)) ? on : off;
        pixels.insert(pixels.end(), pixel.begin(), pixel.end());
      }
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = columns;
    image.height = rows;
    image.format = format;
    ASSERT_NE(
        png_image_write_to_file(&image, (folder_ / name).c_str(), 0, pixels.data(), 0, nullptr), 0);
  }
  OccupancyGrid map_of(const std::string& drawing, std::vector<std::string> flags = {}) const {
    flags.insert(flags.begin(), {"map", drawing, "-o", "one.map.h5", "--label", "L", "--origin",
                                 "robot", "--felt-share", "0.5"});
    done(flags);
    return read_map(folder_ / "one.map.h5");
  }
  /// The part's log odds in the frame of the drawing, whose origin is its lower left corner.
  static void expect_part(const OccupancyGrid& map) {
    const BoundingBox box = occupied_box(map);
    EXPECT_NEAR(box.lower.x, 5.0, map.cell_mm);
    EXPECT_NEAR(box.upper.x, 25.0, map.cell_mm);
    EXPECT_NEAR(box.lower.y, 5.0, map.cell_mm);
    EXPECT_NEAR(box.upper.y, 15.0, map.cell_mm);
    const auto at = [&](double x, double y) {
      return map.at(static_cast<int>((x - map.origin_mm.x) / map.cell_mm),
                    static_cast<int>((y - map.origin_mm.y) / map.cell_mm));
    };
    EXPECT_GT(at(7.0, 12.0), 5.0F) << "up in the picture is +y";
    EXPECT_GT(at(22.0, 7.0), 5.0F);
    EXPECT_LT(at(22.0, 12.0), -5.0F);
  }
};

TEST_F(MapDrawing, TakesPicturesOfAnyKindOfPixel) {
  const std::vector<std::string> dark{"--mm-per-pixel", "0.5"};
  const std::vector<std::string> light{"--mm-per-pixel", "0.5", "--occupied", "light"};
  write_png("grey.png", part);
  expect_part(map_of("grey.png", dark));
  write_png("clear.png", part, {30, 20}, 0.5, PNG_FORMAT_RGBA, {20, 60, 90, 255}, {0, 0, 0, 0});
  expect_part(map_of("clear.png", dark));
  write_png("edge.png", part, {30, 20}, 0.5, PNG_FORMAT_RGBA, {0, 0, 0, 130}, {0, 0, 0, 120});
  expect_part(map_of("edge.png", dark));
  write_png("light.PNG", part, {30, 20}, 0.5, PNG_FORMAT_RGB, {250, 240, 200}, {60, 0, 90});
  expect_part(map_of("light.PNG", light));
  write_png("clear_light.png", part, {30, 20}, 0.5, PNG_FORMAT_GA, {255, 255}, {255, 0});
  expect_part(map_of("clear_light.png", light));
}

TEST_F(MapDrawing, LiesAtItsMiddleAndIsNamedByItsFile) {
  write_png("bar.png", bar);
  write_png("L.png", part);
  const std::string out = done(
      {"map", "bar.png", "L.png", "--mm-per-pixel", "0.5", "-o", "maps/", "--png", "maps.png"});
  EXPECT_THAT(out, HasSubstr("maps/bar.map.h5: bar from bar.png, "));
  EXPECT_THAT(out,
              HasSubstr("lies at x 15.00 mm, y 10.00 mm, theta 0.00 deg in the drawing's frame"));
  EXPECT_THAT(out, HasSubstr("bar looks the same after every 1/2 of a turn"));
  const OccupancyGrid bar = read_map(folder_ / "maps/bar.map.h5");
  const OccupancyGrid l = read_map(folder_ / "maps/L.map.h5");
  EXPECT_TRUE(bar.drawn);
  EXPECT_EQ(bar.suggested_symmetry, 2);
  EXPECT_EQ(bar.prior, l.prior) << "pooled over all drawings of the call";
  EXPECT_THAT(done({"info", "maps/bar.map.h5"}), HasSubstr("in the drawing's frame"));
  done({"map", "bar.png", "--mm-per-pixel", "0.5", "-o", "given.map.h5", "--origin", "10,10,0",
        "--symmetry", "1"});
  const OccupancyGrid given = read_map(folder_ / "given.map.h5");
  EXPECT_NEAR(occupied_box(given).middle().x, 5.0, 0.01);
  EXPECT_FALSE(given.suggested_symmetry) << "not to be taken";
}

TEST_F(MapDrawing, IsRecognisedBesideTouchedObjectsOfAnotherPrior) {
  write_png("I.png", stroke, {10, 30}, 0.1);
  write_recording(folder_ / "A.h5", sample_training("A", 48));
  write_recording(folder_ / "u.h5", sample_unknown("I", {{3.0, -4.0}, 2.0}, 4));
  done({"map", "A.h5", "-o", "A.map.h5"});
  done({"map", "I.png", "--mm-per-pixel", "0.1", "-o", "I.map.h5", "--origin", "5,15,0",
        "--symmetry", "2"});
  const Outcome outcome =
      palpate({"recognize", "u.h5", "--maps", "A.map.h5", "I.map.h5", "--json", "u.json"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "u.json"))[0];
  EXPECT_EQ(record["best"], "I");
  EXPECT_LT(record["refined_error_mm"].get<double>(), 1.0);
}

TEST_F(MapDrawing, TellsCalibrateWhereTheArraySitsInTheTool) {
  write_png("I.png", stroke, {10, 30}, 0.1);
  done({"map", "I.png", "--mm-per-pixel", "0.1", "-o", "I.map.h5"});
  Recording touches = sample_training("I", 96);
  const std::vector<glm::dvec2> sits = touches.elements_mm;
  for (glm::dvec2& p : touches.elements_mm) {
    p -= glm::dvec2(2.0, -1.0);
  }
  for (Pose& pose : touches.T_robot_sensor) {
    pose.translation_mm += glm::dvec2(5.0, 15.0);  // the robot's frame is the drawing's
  }
  write_recording(folder_ / "I.h5", touches);
  const Outcome outcome = palpate(
      {"calibrate", "I.h5", "--maps", "I.map.h5", "-o", "s.yaml", "--write-array", "array.csv"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("the array sits in the tool at x +"));
  std::ifstream array(folder_ / "array.csv");
  std::string line;
  ASSERT_TRUE(std::getline(array, line) && line == "x,y");
  for (const glm::dvec2& p : sits) {
    glm::dvec2 found;
    char comma = ' ';
    ASSERT_TRUE(array >> found.x >> comma >> found.y);
    EXPECT_NEAR(found.x, p.x, 0.25);
    EXPECT_NEAR(found.y, p.y, 0.25);
  }
}

TEST_F(MapDrawing, AnArrayIsWrittenOnlyWhereItsPlaceIsToldAndNeverOverItself) {
  write("array.csv", "x,y\n0,0\n5,0\n0,5\n5,5\n");
  write_png("part.png", part);
  expect_refused(
      {"map", "part.png", "--mm-per-pixel", "0.5", "--array", "array.csv", "-o", "array.csv"},
      {"array.csv"});
  write_recording(folder_ / "A.h5", sample_training("A", 48));
  done({"map", "A.h5", "-o", "A.map.h5"});
  expect_refused({"calibrate", "A.h5", "--maps", "A.map.h5", "-o", "s.yaml", "--layer", "log_odds",
                  "--write-array", "a.csv"},
                 {"--write-array", "drawn maps"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "s.yaml"));
}

TEST_F(MapDrawing, SaysWhichEdgesOfItsPictureAnObjectReaches) {
  const auto said = [&](const std::string& pixels, const char* occupied) {
    write_png(
        "part.png",
        [&](double x, double y) {
          return pixels[static_cast<std::size_t>(y) * 5 + static_cast<std::size_t>(x)] == '#';
        },
        {5, 4}, 1.0);
    const Outcome outcome = palpate(
        {"map", "part.png", "--mm-per-pixel", "5", "--occupied", occupied, "-o", "part.map.h5"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.err;
  };
  const std::pair<const char*, const char*> cases[] = {{"..#.."
                                                        "..#.."
                                                        "....."
                                                        ".....",
                                                        "(upper)"},
                                                       {"....."
                                                        "....."
                                                        "..#.."
                                                        "..#..",
                                                        "(lower)"},
                                                       {"....."
                                                        "##..."
                                                        "##..."
                                                        ".....",
                                                        "(left)"},
                                                       {"....."
                                                        "..###"
                                                        "...##"
                                                        ".....",
                                                        "(right)"},
                                                       {"..###"
                                                        "..###"
                                                        "....."
                                                        ".....",
                                                        "(right, upper)"}};
  for (const auto& [pixels, edges] : cases) {
    EXPECT_THAT(said(pixels, "dark"),
                HasSubstr(std::string("part.png: the object reaches the picture's edge ") + edges +
                          ", and is cut off where it goes on beyond; leave white paper all around "
                          "it"));
  }
  const char* within =
      "....."
      ".###."
      ".###."
      ".....";
  EXPECT_EQ(said(within, "dark"), "");
  EXPECT_THAT(said(within, "light"), HasSubstr("(left, right, lower, upper)"));
  EXPECT_THAT(said(within, "light"), HasSubstr("leave dark paper all around it"));
}

TEST_F(MapDrawing, RefusesBadDrawingsAndFlagsInOneLine) {
  write_png("good.png", part);
  write_png("empty.png", [](double, double) { return false; });
  write("text.png", "hello");
  write_recording(folder_ / "A.h5", sample_training("A", 4));
  const auto refused = [&](std::vector<std::string> arguments,
                           const std::vector<std::string>& named) {
    arguments.insert(arguments.begin(), "map");
    arguments.insert(arguments.end(), {"-o", "x.map.h5"});
    expect_refused(arguments, named);
  };
  write("part.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='9mm' height='9mm'/>");
  refused({"part.svg"}, {"part.svg: drawings are read as PNG", "rsvg-convert -d 254"});
  refused({"empty.png", "--mm-per-pixel", "1"},
          {"empty.png: nothing in it is dark", "--occupied light"});
  refused({"text.png", "--mm-per-pixel", "1"}, {"text.png: is no PNG picture ("});
  refused({"missing.png"}, {"missing.png: no such file"});
  refused({"good.png"},
          {"good.png: a picture of 60 x 40 pixels has no physical size", "--mm-per-pixel"});
  refused({"good.png", "--mm-per-pixel", "0"}, {"--mm-per-pixel 0: give 1e-06 to 1e+06 mm"});
  refused({"good.png", "--occupied", "red"}, {"--occupied red: give dark or light"});
  refused({"good.png", "--threshold", "2"}, {"--threshold: a drawing has no touches"});
  refused({"good.png", "--unposed"}, {"--unposed: a drawing has no touches"});
  refused({"good.png", "--device", "0"}, {"--device: a drawing has no touches"});
  refused({"good.png", "--felt-share", "2"}, {"--felt-share 2: must lie between 0 and 1"});
  refused({"good.png", "--origin", "1,2,3"}, {"--origin 1,2,3: a drawing is not turned"});
  refused({"good.png", "--peak", "0.3"}, {"--peak 0.3: must be above 0.5"});
  refused({"good.png", "--label", "a/b"}, {"good.png: object 'a/b' holds a '/'"});
  refused({"good.png", "A.h5"}, {"A.h5: is no drawing, but good.png is"});
  refused({"good.png", "good.png"}, {"-o x.map.h5: 2 drawings make as many maps"});
  refused({"A.h5", "--felt-share", "0.5"}, {"--felt-share: is of drawings alone"});
  std::filesystem::create_directory(folder_ / "more");
  write_png("more/good.png", part);
  expect_refused({"map", "good.png", "more/good.png", "--mm-per-pixel", "1", "-o", "maps/"},
                 {"more/good.png: would be named 'good', as good.png; rename one of them"});
  expect_refused({"map", "good.png", "good.png", "--label", "a", "-o", "maps/"},
                 {"--label a: names one object"});
}

}  // namespace palpate::map_drawing_test
