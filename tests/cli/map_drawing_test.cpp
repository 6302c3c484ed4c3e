// palpate map on drawings.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>

#include <png.h>

#include "model/bounding_box.hpp"
#include "palpate/files.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::map_drawing_test {

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
  OccupancyGrid map_of(const std::string& drawing, const std::string& flags) const {
    done("map " + drawing + " -o one.map.h5 --label L --origin robot --felt-share 0.5 " + flags);
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
  using Pixel = std::vector<png_byte>;
  const std::string dark = "--mm-per-pixel 0.5";
  const std::string light = dark + " --occupied light";
  for (const auto& [file, format, on, off, flags] :
       std::initializer_list<std::tuple<const char*, png_uint_32, Pixel, Pixel, std::string>>{
           {"grey.png", PNG_FORMAT_GRAY, {0}, {255}, dark},
           {"clear.png", PNG_FORMAT_RGBA, {20, 60, 90, 255}, {0, 0, 0, 0}, dark},
           {"edge.png", PNG_FORMAT_RGBA, {0, 0, 0, 130}, {0, 0, 0, 120}, dark},
           {"light.PNG", PNG_FORMAT_RGB, {250, 240, 200}, {60, 0, 90}, light},
           {"clear_light.png", PNG_FORMAT_GA, {255, 255}, {255, 0}, light}}) {
    SCOPED_TRACE(file);
    write_png(file, part, {30, 20}, 0.5, format, on, off);
    expect_part(map_of(file, flags));
  }
}

TEST_F(MapDrawing, LiesAtItsMiddleAndIsNamedByItsFile) {
  write_png("bar.png", bar);
  write_png("L.png", part);
  expect_named(done("map bar.png L.png --mm-per-pixel 0.5 -o maps/ --png maps.png"),
               {"maps/bar.map.h5: bar from bar.png, ",
                "lies at x 15.00 mm, y 10.00 mm, theta 0.00 deg in the drawing's frame",
                "bar looks the same after every 1/2 of a turn"});
  const OccupancyGrid bar = read_map(folder_ / "maps/bar.map.h5");
  EXPECT_TRUE(bar.drawn);
  EXPECT_EQ(bar.suggested_symmetry, 2);
  EXPECT_EQ(bar.prior, read_map(folder_ / "maps/L.map.h5").prior)
      << "pooled over all drawings of the call";
  expect_named(done("info maps/bar.map.h5"), {"in the drawing's frame"});
  done("map bar.png --mm-per-pixel 0.5 -o given.map.h5 --origin 10,10,0 --symmetry 1");
  const OccupancyGrid given = read_map(folder_ / "given.map.h5");
  EXPECT_NEAR(occupied_box(given).middle().x, 5.0, 0.01);
  EXPECT_FALSE(given.suggested_symmetry) << "not to be taken";
}

TEST_F(MapDrawing, IsRecognisedBesideTouchedObjectsOfAnotherPrior) {
  write_png("I.png", stroke, {10, 30}, 0.1);
  write_recording(folder_ / "A.h5", sample_training("A", 48));
  write_recording(folder_ / "u.h5", sample_unknown("I", {{3.0, -4.0}, 2.0}, 4));
  done("map A.h5 -o A.map.h5");
  done("map I.png --mm-per-pixel 0.1 -o I.map.h5 --origin 5,15,0 --symmetry 2");
  remarks("recognize u.h5 --maps A.map.h5 I.map.h5 --json u.json");
  const auto record = nlohmann::json::parse(bytes_of(folder_ / "u.json"))[0];
  EXPECT_EQ(record["best"], "I");
  EXPECT_LT(record["refined_error_mm"].get<double>(), 1.0);
}

TEST_F(MapDrawing, TellsCalibrateWhereTheArraySitsInTheTool) {
  write_png("I.png", stroke, {10, 30}, 0.1);
  done("map I.png --mm-per-pixel 0.1 -o I.map.h5");
  Recording touches = sample_training("I", 96);
  const std::vector<glm::dvec2> sits = touches.elements_mm;
  for (glm::dvec2& p : touches.elements_mm) {
    p -= glm::dvec2(2.0, -1.0);
  }
  for (Pose& pose : touches.T_robot_sensor) {
    pose.translation_mm += glm::dvec2(5.0, 15.0);  // the robot's frame is the drawing's
  }
  write_recording(folder_ / "I.h5", touches);
  const Outcome outcome =
      palpate("calibrate I.h5 --maps I.map.h5 -o s.yaml --write-array array.csv");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_named(outcome.out,
               {"the array sits in the tool at x +", "levels of readings            2        7"});
  std::ifstream array(folder_ / "array.csv");
  std::string header;
  ASSERT_TRUE(std::getline(array, header) && header == "x,y");
  glm::dvec2 found;
  char comma = ' ';
  for (const glm::dvec2& p : sits) {
    ASSERT_TRUE(array >> found.x >> comma >> found.y);
    EXPECT_LT(glm::distance(found, p), 0.3);
  }
}

TEST_F(MapDrawing, SaysWhichEdgesOfItsPictureAnObjectReaches) {
  const auto said = [&](const glm::dvec2& from, const glm::dvec2& to, const char* flags = "") {
    write_png(
        "part.png",
        [&](double x, double y) { return x >= from.x && x < to.x && y >= from.y && y < to.y; },
        {5, 4}, 1.0);
    return remarks(std::string("map part.png --mm-per-pixel 5 -o part.map.h5 ") + flags);
  };
  for (const auto& [from, to, edges] :
       {std::tuple<glm::dvec2, glm::dvec2, std::string>{{2, 0}, {3, 2}, "(upper)"},
        {{2, 2}, {3, 4}, "(lower)"},
        {{0, 1}, {2, 3}, "(left)"},
        {{3, 1}, {5, 3}, "(right)"},
        {{2, 0}, {5, 2}, "(right, upper)"}}) {
    const std::string words = "part.png: the object reaches the picture's edge " + edges +
                              ", and is cut off where it goes on beyond; leave white paper";
    expect_named(said(from, to), {words.c_str()});
  }
  EXPECT_EQ(said({1, 1}, {4, 3}), "");
  expect_named(said({1, 1}, {4, 3}, "--occupied light"),
               {"(left, right, lower, upper)", "leave dark paper all around it"});
}

TEST_F(MapDrawing, RefusesBadDrawingsAndFlagsInOneLine) {
  std::filesystem::create_directory(folder_ / "more");
  write_png("good.png", part);
  write_png("more/good.png", part);
  write_png("empty.png", [](double, double) { return false; });
  put_bytes(folder_ / "text.png", "hello");
  put_bytes(folder_ / "part.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='9mm'/>");
  put_bytes(folder_ / "array.csv", "x,y\n0,0\n5,0\n0,5\n5,5\n");
  write_recording(folder_ / "A.h5", sample_training("A", 48));
  const std::string one = " -o x.map.h5";
  const std::pair<std::string, std::vector<std::string>> cases[] = {
      {"part.svg" + one, {"part.svg: drawings are read as PNG", "rsvg-convert -d 254"}},
      {"empty.png --mm-per-pixel 1" + one,
       {"empty.png: nothing in it is dark", "--occupied light"}},
      {"text.png --mm-per-pixel 1" + one, {"text.png: is no PNG picture ("}},
      {"good.png" + one,
       {"good.png: a picture of 60 x 40 pixels has no physical size", "--mm-per-pixel"}},
      {"good.png --mm-per-pixel 0" + one, {"--mm-per-pixel 0: give 1e-06 to 1e+06 mm"}},
      {"good.png --occupied red" + one, {"--occupied red: give dark or light"}},
      {"good.png --threshold 2" + one, {"--threshold: a drawing has no touches"}},
      {"good.png --device 0" + one, {"--device: a drawing has no touches"}},
      {"good.png --felt-share 2" + one, {"--felt-share 2: must lie between 0 and 1"}},
      {"good.png --origin 1,2,3" + one, {"--origin 1,2,3: a drawing is not turned"}},
      {"good.png --peak 0.3" + one, {"--peak 0.3: must be above 0.5"}},
      {"good.png --label a/b" + one, {"good.png: object 'a/b' holds a '/'"}},
      {"good.png A.h5" + one, {"A.h5: is no drawing, but good.png is"}},
      {"good.png good.png" + one, {"-o x.map.h5: 2 drawings make as many maps"}},
      {"A.h5 --felt-share 0.5" + one, {"--felt-share: is of drawings alone"}},
      {"good.png more/good.png --mm-per-pixel 1 -o maps/",
       {"more/good.png: would be named 'good', as good.png; rename one of them"}},
      {"good.png good.png --label a -o maps/", {"--label a: names one object"}},
      {"good.png --mm-per-pixel 0.5 --array array.csv -o array.csv", {"array.csv"}}};
  for (const auto& [arguments, named] : cases) {
    expect_refused("map " + arguments, named);
  }
  done("map A.h5 -o A.map.h5");
  expect_refused("calibrate A.h5 --maps A.map.h5 -o s.yaml --layer log_odds --write-array a.csv",
                 {"--write-array", "drawn maps"});
}

}  // namespace palpate::map_drawing_test
