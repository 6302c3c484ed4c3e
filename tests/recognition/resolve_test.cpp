// A request, its scene file, and the task that it resolves to.

#include "recognition/recognition_job.hpp"

#include <memory>
#include <numbers>
#include <utility>

#include <gmock/gmock.h>

#include "options/option.hpp"
#include "palpate/error.hpp"
#include "recognition/filter_choice.hpp"
#include "recognition/recognition_task.hpp"
#include "shapes.hpp"
#include "support/errors.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::resolve_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

Request request_of_shapes() {
  Request request;
  for (const Hypothesis& shape : shapes()) {
    request.given_maps.push_back({shape.map.label, shape});
  }
  request.bins = std::array{6, 5, 4};
  return request;
}

RecognitionTask task_of(const Request& request) {
  return resolve(request, {.pressure_unit = "kPa", .source = "a test", .reach_mm = 8.0});
}

std::string refusal(const Request& request) {
  return input_error([&] { task_of(request); });
}

/// The shapes, with what is changed.
template <class Change>
Request changed(const Change& change) {
  Request request = request_of_shapes();
  change(request);
  return request;
}

TEST(Resolve, TakesBoundsUnlessSomethingAsksForTheHistogramOrTheyHaveNoRoom) {
  Request request = request_of_shapes();
  request.touch_sd_deg = 2.0;
  const RecognitionTask by_bounds = task_of(request);
  const auto& bounded = std::get<BoundedOptions>(by_bounds.filter);
  EXPECT_EQ(by_bounds.filter_chosen_by, "`filter auto`");
  EXPECT_EQ(bounded.tolerance, 1e-6);
  EXPECT_FALSE(bounded.budget_s || bounded.evidence_nats);
  EXPECT_DOUBLE_EQ(bounded.touch_sd.rad, 2.0 * std::numbers::pi / 180.0);

  const RecognitionTask by_posterior =
      resolve(request, {.pressure_unit = "kPa", .every_bin_for = "posterior"});
  EXPECT_DOUBLE_EQ(std::get<HistogramOptions>(by_posterior.filter).touch_sd.rad,
                   bounded.touch_sd.rad);
  EXPECT_EQ(by_posterior.filter_chosen_by, "`posterior`");

  request.bins = std::array{100'000, 100'000, 1};
  const RecognitionTask large = task_of(request);
  const auto& histogram = std::get<HistogramOptions>(large.filter);
  EXPECT_EQ(histogram.lattice.x_mm.count, 100'000) << "too large for both; the histogram says so";
  EXPECT_DOUBLE_EQ(histogram.touch_sd.rad, bounded.touch_sd.rad);
  EXPECT_EQ(large.filter_chosen_by, "`filter auto`");

  request.bins = std::array{1000, 1000, 540};
  request.touch_sd_deg.reset();
  const RecognitionTask many = task_of(request);
  EXPECT_GT(2 * many.lattice().bins(), most_bounded_bins);
  EXPECT_TRUE(traits_of(many.filter).certificate) << "there is room";
}

TEST(Resolve, AnOptionOfBoundsAsksForBounds) {
  const RecognitionTask task = task_of(changed([](Request& r) { r.tolerance = 1e-3; }));
  EXPECT_EQ(std::get<BoundedOptions>(task.filter).tolerance, 1e-3);
  EXPECT_EQ(task.filter_chosen_by, "`tolerance`");
}

TEST(Resolve, ObjectsThatSlipAreFollowedByTheHistogramWhichIsSaidWhereItWasNotAskedFor) {
  const auto said = [](FilterKind filter, const std::string& every_bin_for = "") {
    const Request request = changed([&](Request& r) {
      r.slip_sd_deg = 2.0;
      r.filter = filter;
    });
    const RecognitionTask task = resolve(
        request, {.pressure_unit = "kPa", .source = "a test", .every_bin_for = every_bin_for});
    EXPECT_DOUBLE_EQ(std::get<HistogramOptions>(task.filter).slip_sd.rad,
                     2.0 * std::numbers::pi / 180.0);
    return testing::Value(task.remarks, testing::Contains(HasSubstr("followed by the histogram")));
  };
  EXPECT_TRUE(said(FilterKind::automatic));
  EXPECT_TRUE(said(FilterKind::bounded));
  EXPECT_FALSE(said(FilterKind::histogram));
  EXPECT_FALSE(said(FilterKind::automatic, "posterior"))
      << "for which the histogram is taken anyway";
  EXPECT_TRUE(said(FilterKind::bounded, "posterior"));
}

TEST(Resolve, CountsThatWereSettledBeforeStand) {
  const RecognitionTask task = resolve(
      changed([](Request& r) { r.bins = BinWidth::automatic; }),
      {.pressure_unit = "kPa", .source = "a test", .reach_mm = 8.0, .counts = std::array{7, 8, 9}});
  EXPECT_TRUE(task.auto_pivot);
  EXPECT_EQ(task.lattice().x_mm.count, 7);
  EXPECT_EQ(task.lattice().theta_rad.count, 9);
}

/// The shapes, learned from touches that had these z on maps of the others.
Request request_of_learned() {
  Request request = request_of_shapes();
  request.bins = std::array{40, 40, 200};
  for (std::size_t i = 0; i < 2; ++i) {
    const MapSource source{.touches = {},
                           .options = {},
                           .left_out = FitScale{0.5 + double(i), 0.5},
                           .pose_scale = PoseScale{0.5, 0.1}};
    request.given_maps[i].hypothesis.map.source = std::make_shared<const MapSource>(source);
  }
  return request;
}

TEST(Resolve, ASearchOfPoorFitsGoesOnWhereClosenessIsAskedFor) {
  const ScratchFolder folder;
  const std::string file = folder / "s.yaml";
  LearnedSensor sensor{.table = LearnedTable{}};
  sensor.table->shared.assign(2 * ReadingLayer::nodes, -1.0);
  write_sensor_model(file, sensor);
  const auto poor_bins = [&](const auto& change) {
    Request request = changed(change);
    request.sensor_model = file;
    request.filter = FilterKind::bounded;
    return std::get<BoundedOptions>(task_of(request).filter).poor_bins.has_value();
  };
  EXPECT_TRUE(poor_bins([](Request&) {}));
  EXPECT_FALSE(poor_bins([](Request& r) { r.tolerance = 1e-6; }));
  EXPECT_FALSE(poor_bins([](Request& r) { r.evidence_nats = 0.1; }));
}

TEST(Resolve, TheFitsScaleIsOfTouchesThatMapsHadNotSeen) {
  Request request = request_of_learned();
  EXPECT_EQ(task_of(request).fit_scale().mean, 1.0);
  EXPECT_GT(task_of(request).fit_scale().shared_sd, 0.3);
  request.given_maps[0].hypothesis.map.source.reset();
  EXPECT_EQ(task_of(request).fit_scale().mean, 1.5) << "of the maps that have one";
}

TEST(Resolve, BinsOfALargeRegionResolveTheMapsWhereThePivotLiesAtATouch) {
  Request request = request_of_learned();
  request.x_mm = request.y_mm = std::array{-200.0, 200.0};
  request.bins = std::array{800, 800, 200};
  request.filter = FilterKind::bounded;
  const RecognitionTask far = task_of(request);
  EXPECT_EQ(far.fit_scale().mean, 0.0);
  EXPECT_EQ(far.labels.size(), 2u);
  EXPECT_THAT(far.remarks, ElementsAre(AllOf(HasSubstr("an object 283 mm from the pivot by 8.9 mm"),
                                             HasSubstr("\"(none)\" is left out"),
                                             HasSubstr("`pivot-mm auto`"))));
  request.pivot_mm = Automatic{};
  const RecognitionTask near = task_of(request);
  EXPECT_EQ(near.fit_scale().mean, 1.0);
  EXPECT_EQ(near.labels.back(), none_label);
  EXPECT_THAT(near.remarks, testing::IsEmpty());
}

TEST(Resolve, TouchesThatAreJudgedOtherwiseHaveNoScale) {
  for (const auto& [option, text] : {std::pair{"gamma", "0.2"},
                                     {"prior", "0.4"},
                                     {"threshold", "3"},
                                     {"ratio", "0.2"},
                                     {"touch-sd-mm", "1"},
                                     {"slip-sd-deg", "1"},
                                     {"filter", "particles"},
                                     {"bins", "6x5x4"}}) {
    SCOPED_TRACE(option);
    Request request = request_of_learned();
    ASSERT_EQ(set_option(request, option_named(option), text), "");
    const RecognitionTask task = task_of(request);
    EXPECT_EQ(std::pair(task.fit_scale().mean, task.fit_scale().sd), std::pair(0.0, 1.0));
    // Poses have the map's errors always, and the readings' where these are judged as the map did.
    const bool readings_alike = request.touch_sd_mm || request.slip_sd_deg;
    EXPECT_NEAR(task.pose_scale().factor, readings_alike ? 0.5 : 1.0, 1e-12);
    EXPECT_NEAR(task.pose_scale().map_sd_mm, 0.1, 1e-12);
  }
}

/// The bins of the shapes on a filter of the shared device.
ChosenBins chosen(const FilterOptions& filter, BinWidth width = BinWidth::fine) {
  return chosen_bins(shared_device, shapes(), filter, width);
}

PoseLattice wide_lattice() { return {.x_mm = {-1000.0, 1000.0, 1}, .y_mm = {-1000.0, 1000.0, 1}}; }

TEST(ChosenBins, AreThoseOfTheMapsWhereTheDeviceHoldsSoMany) {
  for (const FilterOptions& filter : every_filter()) {
    const BalancedLattice bins = chosen(filter).balanced;
    EXPECT_FALSE(bins.coarsened);
    const PoseLattice balanced =
        balanced_lattice(lattice_of(filter), shapes(), most_balanced_bins, BinWidth::fine).lattice;
    EXPECT_EQ(bins.lattice.x_mm.count, balanced.x_mm.count);
    EXPECT_EQ(bins.lattice.theta_rad.count, balanced.theta_rad.count);
  }
}

TEST(ChosenBins, FollowUncertainTouches) {
  const DisplacementSd sd{.mm = 2.0, .rad = 0.2};
  const auto step_mm = [](const FilterOptions& filter) {
    return chosen(filter, BinWidth::automatic).balanced.step_mm;
  };
  const double exact = step_mm(BoundedOptions{});
  EXPECT_GT(step_mm(BoundedOptions{.touch_sd = sd}), 1.2 * exact);
  EXPECT_EQ(step_mm(HistogramOptions{.touch_sd = sd}), step_mm(BoundedOptions{.touch_sd = sd}));
  EXPECT_EQ(step_mm(ParticleOptions{}), exact);
}

TEST(ChosenBins, AreCoarserWhereTheDeviceHoldsFewerButForBounds) {
  const HistogramOptions histogram{.lattice = wide_lattice()};
  const std::int64_t held = most_bins_on(shared_device());
  const ChosenBins coarse = chosen(histogram);
  ASSERT_TRUE(coarse.balanced.coarsened);
  EXPECT_EQ(coarse.most_bins, held);
  EXPECT_LE(2 * coarse.balanced.lattice.bins(), held);
  EXPECT_GT(coarse.balanced.step_mm, balanced_step * 0.5) << "of cells of 0.5 mm";
  const ChosenBins bins = chosen(BoundedOptions{.lattice = wide_lattice()});
  ASSERT_TRUE(bins.balanced.coarsened);
  EXPECT_EQ(bins.most_bins, most_bounded_bins);
  const std::int64_t all = 2 * bins.balanced.lattice.bins();
  EXPECT_LE(all, most_bounded_bins);
  EXPECT_GT(all, most_balanced_bins) << "more than any histogram gets";
}

TEST(Request, ValuesThatCannotBeMeantAreRefusedByOption) {
  const auto expect_refused = [](const char* named, const auto& change) {
    EXPECT_THAT(refusal(complete(changed(change))), HasSubstr(named));
  };
  expect_refused("`bins 0x1x1`", [](Request& r) { r.bins = std::array<int, 3>{0, 1, 1}; });
  expect_refused("`x-mm 5:-5`", [](Request& r) { r.x_mm = Range{5.0, -5.0}; });
  expect_refused("full circle", [](Request& r) { r.theta_deg = Range{0.0, 400.0}; });
  expect_refused("`pivot-mm 1", [](Request& r) { r.pivot_mm = glm::dvec2(1e10, 0.0); });
  expect_refused("`gamma 1`", [](Request& r) { r.gamma = 1.0; });
  expect_refused("`none -1`", [](Request& r) { r.none = -1.0; });
  expect_refused("`act-below-mm 0`", [](Request& r) { r.act_below_mm = 0.0; });
  expect_refused("`act-above 1.5`", [](Request& r) { r.act_above = 1.5; });
  expect_refused("`tolerance`", [](Request& r) { r.slip_sd_deg = 2.0, r.tolerance = 1e-3; });
  expect_refused("`maps`: missing", [](Request& r) { r.given_maps.clear(); });
}

}  // namespace palpate::resolve_test
