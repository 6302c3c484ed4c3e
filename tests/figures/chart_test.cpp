#include "figures/chart.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "picture.hpp"

namespace palpate::chart_test {

const Colour red{1.0, 0.0, 0.0};
const Colour blue{0.0, 0.0, 1.0};

Picture drawn(const Chart& chart) { return decode(draw_chart(chart, PictureFormat::png).bytes); }

int count_of(const Picture& picture, const Colour& colour) {
  return static_cast<int>(std::count(picture.pixels.begin(), picture.pixels.end(), rgb(colour)));
}

Chart chart_of(ChartSeries series) {
  Chart chart{.x = {.label = "x", .lower = 0.0, .upper = 10.0},
              .y = {.label = "y", .lower = 0.0, .upper = 10.0}};
  chart.series.push_back(std::move(series));
  return chart;
}

std::uint32_t at(const Picture& picture, glm::dvec2 pixel) {
  return picture.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
}

TEST(Chart, DrawsMarksOfEveryShapeAtTheirPoints) {
  for (const Mark mark : {Mark::circle, Mark::square, Mark::triangle, Mark::diamond, Mark::cross}) {
    const Chart chart = chart_of(
        {.name = "",
         .colour = red,
         .mark = mark,
         .points = {{.x = 2.0, .y = 8.0, .title = "high"}, {.x = 9.0, .y = 1.0, .title = "low"}}});
    const ChartPicture picture = draw_chart(chart, PictureFormat::png);
    const Picture pixels = decode(picture.bytes);
    ASSERT_EQ(picture.spots.size(), 2u);
    EXPECT_EQ(picture.spots[0].title, "high");
    EXPECT_LT(picture.spots[0].at_px.x, picture.spots[1].at_px.x);
    EXPECT_LT(picture.spots[0].at_px.y, picture.spots[1].at_px.y) << "y points up";
    for (const ChartSpot& spot : picture.spots) {
      EXPECT_EQ(at(pixels, spot.at_px), rgb(red));
    }
    EXPECT_EQ(pixels.width, picture.width_px);
    EXPECT_EQ(pixels.height, picture.height_px);
  }
}

TEST(Chart, LeavesAHollowMarkWhite) {
  const ChartPicture picture =
      draw_chart(chart_of({.name = "",
                           .colour = red,
                           .fill = MarkFill::hollow,
                           .points = {{.x = 5.0, .y = 5.0, .title = "here"}}}),
                 PictureFormat::png);
  EXPECT_EQ(at(decode(picture.bytes), picture.spots.at(0).at_px), rgb(white));
}

TEST(Chart, LeavesOutWhatItsAxisDoesNotHold) {
  Chart chart = chart_of({.name = "",
                          .colour = red,
                          .line = Line::solid,
                          .points = {{.x = 1.0, .y = 0.0, .title = "zero"},
                                     {.x = 1.0, .y = -1.0, .title = "negative"},
                                     {.x = NAN, .y = 1.0, .title = "NaN"},
                                     {.x = 1.0, .y = 1.0, .title = "one"}}});
  chart.y = {.label = "y", .scale = Scale::logarithmic};
  const ChartPicture picture = draw_chart(chart, PictureFormat::png);
  ASSERT_EQ(picture.spots.size(), 1u);
  EXPECT_EQ(picture.spots[0].title, "one");
}

TEST(Chart, MarksNothingBeyondTheEndsOfAnAxis) {
  const ChartPicture picture =
      draw_chart(chart_of({.name = "",
                           .colour = red,
                           .points = {{.x = 5.0, .y = 10.5, .title = "above"},
                                      {.x = -0.5, .y = 5.0, .title = "left"},
                                      {.x = 10.0, .y = 10.0, .title = "corner"}}}),
                 PictureFormat::png);
  ASSERT_EQ(picture.spots.size(), 1u);
  EXPECT_EQ(picture.spots[0].title, "corner");
}

TEST(Chart, BandHasTheGapsOfItsLine) {
  ChartSeries series{.name = "", .colour = red, .mark = Mark::none};
  series.interval = IntervalShape::band;
  for (double x = 0.0; x <= 10.0; ++x) {
    series.points.push_back({.x = x, .y = 5.0, .low = 3.0, .high = 7.0});
  }
  const auto pale = [&] {
    const Picture picture = drawn(chart_of(series));
    return static_cast<double>(
        std::count_if(picture.pixels.begin(), picture.pixels.end(), [](std::uint32_t pixel) {
          return pixel >> 16 > 0xF0 && (pixel & 0xFF) < 0xE8 && (pixel & 0xFF) > 0xC0;
        }));
  };
  const double whole = pale();
  series.points[4].y = NAN;
  EXPECT_NEAR(pale() / whole, 0.8, 0.02) << "two of ten segments";
}

TEST(Chart, LineHasAGapWhereAPointIsMissing) {
  ChartSeries series{.name = "", .colour = red, .mark = Mark::none, .line = Line::solid};
  for (double x = 0.0; x <= 10.0; ++x) {
    series.points.push_back({.x = x, .y = 5.0});
  }
  const int whole = count_of(drawn(chart_of(series)), red);
  series.points[4].y = NAN;
  const int broken = count_of(drawn(chart_of(series)), red);
  EXPECT_NEAR(static_cast<double>(broken) / whole, 0.8, 0.02) << "two of ten segments";
}

TEST(Chart, MarksEveryFifthPoint) {
  ChartSeries series{.name = "", .colour = red, .mark_every = 5};
  for (double x = 0.0; x <= 10.0; ++x) {
    series.points.push_back({.x = x, .y = 5.0, .title = "mark"});
  }
  EXPECT_EQ(draw_chart(chart_of(series), PictureFormat::png).spots.size(), 3u);
}

TEST(Chart, DrawsIntervalsAsBarsAndAsABand) {
  ChartSeries series{.name = "", .colour = red, .mark = Mark::none};
  for (double x = 1.0; x <= 9.0; ++x) {
    series.points.push_back({.x = x, .y = 5.0, .low = 3.0, .high = 7.0});
  }
  const int bars = count_of(drawn(chart_of(series)), red);
  EXPECT_GT(bars, 9 * 200) << "nine bars of two fifths of the axis";
  series.interval = IntervalShape::band;
  const Picture band = drawn(chart_of(series));
  EXPECT_EQ(count_of(band, red), 0) << "a band is pale";
  const int reddish = static_cast<int>(
      std::count_if(band.pixels.begin(), band.pixels.end(), [](std::uint32_t pixel) {
        return pixel >> 16 > 0xF0 && (pixel & 0xFF) < 0xE8 && (pixel & 0xFF) > 0xC0;
      }));
  EXPECT_GT(reddish, 200 * 900);
}

TEST(Chart, NamesSeriesAboveTheAxesInRowsAsNeeded) {
  Chart chart = chart_of({.name = "one", .colour = red});
  const int one_row = draw_chart(chart, PictureFormat::png).height_px;
  EXPECT_GT(count_of(drawn(chart), red), 100) << "the legend has a mark";
  for (int i = 0; i < 12; ++i) {
    chart.series.push_back({.name = "another series of this chart", .colour = blue});
  }
  EXPECT_GT(draw_chart(chart, PictureFormat::png).height_px, one_row + 60);
}

TEST(Chart, LabelsDoNotCoverEachOther) {
  ChartSeries series{.name = "", .colour = red, .mark = Mark::none};
  series.points.assign(1, {.x = 5.0, .y = 5.0, .label = "8888"});
  const int one = count_of(drawn(chart_of(series)), red);
  ASSERT_GT(one, 0);
  series.points.assign(40, series.points.front());
  const int many = count_of(drawn(chart_of(series)), red);
  EXPECT_GT(many, 2 * one);
  EXPECT_LE(many, 6.2 * one) << "there are six places around a point";
}

TEST(Chart, DrawsRulesAcross) {
  Chart chart = chart_of({.name = "", .points = {}});
  chart.rules = {{.at = 5.0, .colour = red, .label = ""},
                 {.vertical = true, .at = 5.0, .colour = blue, .label = ""}};
  const Picture picture = drawn(chart);
  // Dots of a third of the way, less their blurred ends.
  EXPECT_GT(count_of(picture, red), 200);
  EXPECT_GT(count_of(picture, blue), 100);
}

TEST(Chart, WithoutAnythingToShowHasAxes) {
  for (const Scale scale : {Scale::linear, Scale::logarithmic}) {
    const Picture picture = drawn({.x = {.label = "x", .scale = scale}, .y = {.label = "y"}});
    EXPECT_GT(count_of(picture, ink), 100);
  }
}

TEST(Chart, IsTheSamePictureAsSvg) {
  const Chart chart = chart_of({.name = "<&>", .points = {{.x = 5.0, .y = 5.0, .title = "t"}}});
  const ChartPicture svg = draw_chart(chart, PictureFormat::svg);
  const ChartPicture png = draw_chart(chart, PictureFormat::png);
  EXPECT_TRUE(svg.bytes.starts_with("<?xml"));
  EXPECT_TRUE(svg.bytes.ends_with("</svg>\n"));
  EXPECT_EQ(svg.height_px, png.height_px);
  EXPECT_EQ(svg.spots.at(0).at_px, png.spots.at(0).at_px);
}

}  // namespace palpate::chart_test
