// palpate map on drawings, SVG and PNG.

#include <fstream>

#include <gmock/gmock.h>
#include <png.h>

#include "model/bounding_box.hpp"
#include "palpate/files.hpp"
#include "program.hpp"
#include "sample_files.hpp"

namespace palpate::map_drawing_test {

using testing::HasSubstr;

// A bar 20 mm wide and 4 mm high whose left end is 10 mm high: an L lying on its back.
const std::string part = "<path d='M5 5V15H25V11H9V5Z'/>";

class MapDrawing : public ProgramTest {
 protected:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  /// An SVG drawing whose unit is 1 mm where it is 30 mm wide and 20 mm high.
  void write_svg(const std::string& name, const std::string& size,
                 const std::string& inside) const {
    write(name,
          "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' " +
              size + ">" + inside + "</svg>");
  }
  /// A PNG picture of 5 x 4 pixels, from "....." for each row: '#' is black.
  void write_grey_png(const std::string& name, const std::string& pixels) const {
    std::vector<png_byte> grey;
    for (const char pixel : pixels) {
      grey.push_back(pixel == '#' ? 0 : 255);
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = 5;
    image.height = 4;
    image.format = PNG_FORMAT_GRAY;
    ASSERT_EQ(grey.size(), 20u);
    ASSERT_NE(png_image_write_to_file(&image, (folder_ / name).c_str(), 0, grey.data(), 0, nullptr),
              0);
  }
  /// A PNG picture of 60 x 40 pixels of a format of libpng, the part in pixels of 0.5 mm.
  void write_png(const std::string& name, png_uint_32 format, const std::vector<png_byte>& on,
                 const std::vector<png_byte>& off) const {
    std::vector<png_byte> pixels;
    for (int row = 0; row < 40; ++row) {
      for (int column = 0; column < 60; ++column) {
        const double x = 0.5 * column;
        const double y = 0.5 * row;
        const bool is_on = x >= 5.0 && y < 15.0 && (y >= 11.0 ? x < 25.0 : y >= 5.0 && x < 9.0);
        pixels.insert(pixels.end(), is_on ? on.begin() : off.begin(), is_on ? on.end() : off.end());
      }
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = 60;
    image.height = 40;
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

TEST_F(MapDrawing, IsAtItsPhysicalSize) {
  const std::string box = " viewBox='0 0 30 20'";
  for (const char* size :
       {"width='30mm' height='20mm'", "height='20mm'", "width='3cm' height='20mm'",
        "width='1.18110236in' height='56.6929134pt'"}) {
    SCOPED_TRACE(size);
    write_svg("part.svg", size + box, part);
    expect_part(map_of("part.svg"));
    expect_refused({"map", "part.svg", "--mm-per-pixel", "1", "-o", "x.map.h5"},
                   {"part.svg: is 30 x 20 mm large", "leave --mm-per-pixel 1 out"});
  }
  for (const auto& [size, mm] : {std::pair{"width='300' height='200'" + box, "0.1"}, {box, "1"}}) {
    SCOPED_TRACE(size);
    write_svg("part.svg", size, part);
    expect_part(map_of("part.svg", {"--mm-per-pixel", mm}));
    expect_refused({"map", "part.svg", "-o", "x.map.h5"},
                   {"part.svg: has no width and height in mm", "--mm-per-pixel"});
  }
  write_svg("none.svg", "", part);
  expect_refused({"map", "none.svg", "-o", "x.map.h5"}, {"none.svg: has neither width and height"});
}

TEST_F(MapDrawing, TakesPicturesOfAnyKindOfPixel) {
  const std::vector<std::string> dark{"--mm-per-pixel", "0.5"};
  const std::vector<std::string> light{"--mm-per-pixel", "0.5", "--occupied", "light"};
  write_png("grey.png", PNG_FORMAT_GRAY, {0}, {255});
  expect_part(map_of("grey.png", dark));
  write_png("clear.png", PNG_FORMAT_RGBA, {20, 60, 90, 255}, {0, 0, 0, 0});
  expect_part(map_of("clear.png", dark));
  write_png("edge.png", PNG_FORMAT_RGBA, {0, 0, 0, 130}, {0, 0, 0, 120});
  expect_part(map_of("edge.png", dark));
  write_png("light.PNG", PNG_FORMAT_RGB, {250, 240, 200}, {60, 0, 90});
  expect_part(map_of("light.PNG", light));
  write_png("clear_light.png", PNG_FORMAT_GA, {255, 255}, {255, 0});
  expect_part(map_of("clear_light.png", light));
}

TEST_F(MapDrawing, LiesAtItsMiddleAndIsNamedByItsFile) {
  const std::string size = "width='30mm' height='20mm' viewBox='0 0 30 20'";
  write_svg("bar.svg", size, "<rect x='5' y='8' width='20' height='4'/>");
  write_svg("L.svg", size, part);
  const std::string out = done({"map", "bar.svg", "L.svg", "-o", "maps/", "--png", "maps.png"});
  EXPECT_THAT(out, HasSubstr("maps/bar.map.h5: bar from bar.svg, "));
  EXPECT_THAT(out,
              HasSubstr("lies at x 15.00 mm, y 10.00 mm, theta 0.00 deg in the drawing's frame"));
  EXPECT_THAT(out, HasSubstr("bar looks the same after every 1/2 of a turn"));
  const OccupancyGrid bar = read_map(folder_ / "maps/bar.map.h5");
  const OccupancyGrid l = read_map(folder_ / "maps/L.map.h5");
  EXPECT_TRUE(bar.drawn);
  EXPECT_EQ(bar.suggested_symmetry, 2);
  EXPECT_EQ(bar.prior, l.prior) << "pooled over all drawings of the call";
  EXPECT_THAT(done({"info", "maps/bar.map.h5"}), HasSubstr("in the drawing's frame"));
  done({"map", "bar.svg", "-o", "given.map.h5", "--origin", "10,10,0", "--symmetry", "1"});
  const OccupancyGrid given = read_map(folder_ / "given.map.h5");
  EXPECT_NEAR(occupied_box(given).middle().x, 5.0, 0.01);
  EXPECT_FALSE(given.suggested_symmetry) << "not to be taken";
}

TEST_F(MapDrawing, IsRecognisedBesideTouchedObjectsOfAnotherPrior) {
  write_svg("I.svg", "width='10mm' height='30mm' viewBox='-5 -15 10 30'",
            "<path d='M0-10.25V10.25' stroke='#000' stroke-width='4.5' stroke-linecap='round'/>");
  write_recording(folder_ / "A.h5", sample_training("A", 48));
  write_recording(folder_ / "u.h5", sample_unknown("I", {{3.0, -4.0}, 2.0}, 4));
  done({"map", "A.h5", "-o", "A.map.h5"});
  done({"map", "I.svg", "-o", "I.map.h5", "--origin", "5,15,0", "--symmetry", "2"});
  const Outcome outcome =
      palpate({"recognize", "u.h5", "--maps", "A.map.h5", "I.map.h5", "--json", "u.json"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "u.json"))[0];
  EXPECT_EQ(record["best"], "I");
  EXPECT_LT(record["refined_error_mm"].get<double>(), 1.0);
}

TEST_F(MapDrawing, TellsCalibrateWhereTheArraySitsInTheTool) {
  write_svg("I.svg", "width='10mm' height='30mm' viewBox='0 0 10 30'",
            "<path d='M5 4.75V25.25' stroke='#000' stroke-width='4.5' stroke-linecap='round'/>");
  done({"map", "I.svg", "-o", "I.map.h5"});
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
  write_svg("part.svg", "width='30mm' height='20mm' viewBox='0 0 30 20'", part);
  expect_refused({"map", "part.svg", "--array", "array.csv", "-o", "array.csv"}, {"array.csv"});
  write_recording(folder_ / "A.h5", sample_training("A", 48));
  done({"map", "A.h5", "-o", "A.map.h5"});
  expect_refused({"calibrate", "A.h5", "--maps", "A.map.h5", "-o", "s.yaml", "--layer", "log_odds",
                  "--write-array", "a.csv"},
                 {"--write-array", "drawn maps"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "s.yaml"));
}

TEST_F(MapDrawing, SaysWhichEdgesOfItsPictureAnObjectReaches) {
  const auto said = [&](const std::string& pixels, const char* occupied) {
    write_grey_png("part.png", pixels);
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

TEST_F(MapDrawing, RefusesWhatIsNotInTheDrawing) {
  const std::string size = "width='30mm' height='20mm'";
  for (const char* inside :
       {"<image href='photo.png' width='9' height='9'/>", "<use xlink:href = \"other.svg#a\"/>",
        "<style>@import 'a.css';</style>", "<path d='M0 0h9v9z' fill='url(other.svg#a)'/>",
        "<style>path { fill: url( \"http://example.org/a.svg#b\" ) }</style>"}) {
    write_svg("part.svg", size, part + inside);
    expect_refused({"map", "part.svg", "-o", "x.map.h5"},
                   {"part.svg: refers to '", "which is not in it; embed or remove it"});
  }
  write("part.svg",
        "<!DOCTYPE svg [<!ENTITY a SYSTEM 'part.txt'>]><svg xmlns="
        "'http://www.w3.org/2000/svg' width='9mm' height='9mm'>&a;</svg>");
  expect_refused({"map", "part.svg", "-o", "x.map.h5"}, {"part.svg: refers to '<!ENTITY a SYSTEM"});
  write_svg("part.svg", size,
            "<image href='data:image/png;base64,iVBORw0KGgo=' width='9' height='9'/>");
  expect_refused({"map", "part.svg", "-o", "x.map.h5"}, {"part.svg: holds a picture; trace it"});
  // What is within it is no reference to elsewhere.
  write_svg("part.svg", size + " viewBox='0 0 30 20'",
            "<defs><path id='a' d='M5 5V15H25V11H9V5Z'/><linearGradient id='g'/></defs>"
            "<a href='#top'><use xlink:href='#a' style=\"clip-path:url(&quot;#none&quot;)\"/></a>");
  expect_part(map_of("part.svg"));
}

TEST_F(MapDrawing, RefusesBadDrawingsAndFlagsInOneLine) {
  const std::string size = "width='30mm' height='20mm' viewBox='0 0 30 20'";
  write_svg("good.svg", size, part);
  write_svg("empty.svg", size, "");
  write_svg("large.svg", "width='9m' height='9m'", part);
  write_svg("wide.svg", "width='8000mm' height='1mm'", "<rect width='90' height='90'/>");
  write("broken.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='9mm' height='9mm'><path");
  write("text.svg", "hello");
  write("text.png", "hello");
  write_png("good.png", PNG_FORMAT_GRAY, {0}, {255});
  write_recording(folder_ / "A.h5", sample_training("A", 4));
  const auto refused = [&](std::vector<std::string> arguments,
                           const std::vector<std::string>& named) {
    arguments.insert(arguments.begin(), "map");
    arguments.insert(arguments.end(), {"-o", "x.map.h5"});
    expect_refused(arguments, named);
  };
  refused({"empty.svg"}, {"empty.svg: nothing in it is dark", "--occupied light"});
  refused({"large.svg"}, {"large.svg: has neither width and height"});  // no unit of SVG
  refused({"wide.svg"}, {"wide.svg: 80000 x 10 pixels are more than 32767 along one side"});
  refused({"good.svg", "--cell-mm", "0.001"},
          {"good.svg: 150000 x 100000 pixels are more than 1e+08"});
  refused({"broken.svg"}, {"broken.svg: is no SVG drawing (", "save it again as plain SVG"});
  refused({"text.svg"}, {"text.svg: holds no <svg> element"});
  refused({"text.png", "--mm-per-pixel", "1"}, {"text.png: is no PNG picture ("});
  refused({"missing.png"}, {"missing.png: no such file"});
  refused({"good.png"},
          {"good.png: a picture of 60 x 40 pixels has no physical size", "--mm-per-pixel"});
  refused({"good.png", "--mm-per-pixel", "0"}, {"--mm-per-pixel 0: give 1e-06 to 1e+06 mm"});
  refused({"good.svg", "--occupied", "red"}, {"--occupied red: give dark or light"});
  refused({"good.svg", "--threshold", "2"}, {"--threshold: a drawing has no touches"});
  refused({"good.svg", "--unposed"}, {"--unposed: a drawing has no touches"});
  refused({"good.svg", "--device", "0"}, {"--device: a drawing has no touches"});
  refused({"good.svg", "--felt-share", "2"}, {"--felt-share 2: must lie between 0 and 1"});
  refused({"good.svg", "--origin", "1,2,3"}, {"--origin 1,2,3: a drawing is not turned"});
  refused({"good.svg", "--peak", "0.3"}, {"--peak 0.3: must be above 0.5"});
  refused({"good.svg", "--label", "a/b"}, {"good.svg: object 'a/b' holds a '/'"});
  refused({"good.svg", "A.h5"}, {"A.h5: is no drawing, but good.svg is"});
  refused({"good.svg", "good.png"}, {"-o x.map.h5: 2 drawings make as many maps"});
  refused({"A.h5", "--felt-share", "0.5"}, {"--felt-share: is of drawings, SVG or PNG, alone"});
  expect_refused({"map", "good.svg", "good.png", "--mm-per-pixel", "1", "-o", "maps/"},
                 {"good.png: would be named 'good', as good.svg; rename one of them"});
  expect_refused({"map", "good.svg", "good.png", "--label", "a", "-o", "maps/"},
                 {"--label a: names one object"});
}

}  // namespace palpate::map_drawing_test
