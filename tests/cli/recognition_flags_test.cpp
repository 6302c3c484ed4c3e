// Every option of a recognition, from its flag or its scene key to the task. Nothing starts the
// program here.

#include "recognition_flags.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <nlohmann/json.hpp>

#include "cli/step_words.hpp"

namespace palpate::cli::recognition_flags_test {

using nlohmann::json;
using namespace nlohmann::literals;

double rounded(double number) { return std::round(number * 1e9) / 1e9; }

template <typename Value>
json rounded(const std::optional<Value>& number) {
  return number ? json(rounded(static_cast<double>(*number))) : json();
}

/// All that can be asked of a task, less its maps; angles in degrees.
json told(const RecognitionTask& task) {
  constexpr double degrees = 180.0 / std::numbers::pi;
  const auto axis = [](const Axis& of, double unit) {
    return json{rounded(of.lower * unit), rounded(of.upper * unit), of.count};
  };
  const auto sd = [](const DisplacementSd& of) {
    return json{rounded(of.mm), rounded(of.rad * degrees)};
  };
  const PoseLattice& lattice = task.lattice();
  const FilterTraits traits = traits_of(task.filter);
  json all{{"x", axis(lattice.x_mm, 1.0)},
           {"y", axis(lattice.y_mm, 1.0)},
           {"theta", axis(lattice.theta_rad, degrees)},
           {"pivot", {lattice.pivot_mm.x, lattice.pivot_mm.y}},
           {"auto_pivot", task.auto_pivot},
           {"prior", rounded(task.contact().prior)},
           {"gamma", task.contact().gamma},
           {"threshold", task.classifier().threshold},
           {"ratio", task.classifier().ratio},
           {"touch_sd", sd(traits.touch_sd)},
           {"slip_sd", sd(traits.slip_sd)},
           {"none", rounded(traits.none_weight)},
           {"labels", task.labels},
           {"by_place", task.by_place},
           {"act", {task.act.below_mm, task.act.above}},
           {"filter", task.filter.index()},
           {"trace_tolerance", rounded(task.trace_tolerance)},
           {"drawn_tolerance", rounded(task.drawn_tolerance)},
           {"tolerance", rounded(traits.tolerance)},
           {"budget_s", rounded(traits.budget_s)},
           {"sensor", task.sensor.file.empty() ? 0.0 : task.sensor.temperature}};
  const auto* bounded = std::get_if<BoundedOptions>(&task.filter);
  all["evidence_nats"] = bounded != nullptr ? rounded(bounded->evidence_nats) : json();
  if (const auto* of = std::get_if<ParticleOptions>(&task.filter)) {
    all["particles"] = {of->particles, of->resampling == Resampling::systematic, of->augmented,
                        of->seed};
    all["motion"] = sd({of->motion_mm, of->motion_rad});
  }
  return all;
}

/// What is told of 20 x 20 x 72 bins and no other option.
const json papers = R"json({
  "x": [-10, 10, 20], "y": [-10, 10, 20], "theta": [0, 360, 72], "pivot": [0, 0],
  "auto_pivot": false, "prior": null, "gamma": 0.1, "threshold": 2, "ratio": 0.3,
  "touch_sd": [0, 0], "slip_sd": [0, 0], "none": 0.222222222, "labels": ["A", "I", "(none)"],
  "by_place": true, "act": [0.5, 0.99], "filter": 1,
  "trace_tolerance": 1e-4, "drawn_tolerance": 1e-3, "tolerance": 1e-6, "budget_s": null,
  "evidence_nats": null, "sensor": 0
})json"_json;

class TaskOfFlags : public RecognitionFlags {
 protected:
  json task_told(const Flags& flags, const std::string& scene = "") const {
    return told(job(flags, scene).task());
  }
};

/// An option, its value as a flag and as a key of scene files, and what the value changes.
struct Wish {
  std::string option;
  std::string value;
  std::string scene;  ///< "" where scenes have no such key
  json changes;
  std::string filter = "bounded";  ///< beside which it stands
};

const std::vector<Wish>& wishes() {
  static const std::vector<Wish> all{
      {"bins", "5x4x3", "bins: [5, 4, 3]",
       // Such bins are too wide to tell "(none)".
       R"({"x": [-10, 10, 5], "y": [-10, 10, 4], "theta": [0, 360, 3], "none": null,
           "labels": ["A", "I"]})"_json},
      {"x-mm", "-4:9", "region: {x_mm: [-4, 9]}", {{"x", {-4, 9, 20}}}},
      {"y-mm", "-4:9", "region: {y_mm: [-4, 9]}", {{"y", {-4, 9, 20}}}},
      {"theta-deg", "10:80", "region: {theta_deg: [10, 80]}", {{"theta", {10, 80, 72}}}},
      {"theta-deg", "57:57", "region: {theta_deg: [57, 57]}", {{"theta", {57, 57, 1}}}},
      {"pivot-mm", "3,-2", "region: {pivot_mm: [3, -2]}", {{"pivot", {3, -2}}}},
      {"pivot-mm", "auto", "region: {pivot_mm: auto}", {{"auto_pivot", true}}},
      {"prior", "0.35", "prior: 0.35", {{"prior", 0.35}}},
      {"gamma", "0.3", "gamma: 0.3", {{"gamma", 0.3}}},
      {"threshold", "5", "threshold: 5", {{"threshold", 5}}},
      {"ratio", "0.6", "ratio: 0.6", {{"ratio", 0.6}}},
      {"touch-sd-mm", "1", "touch_sd: {mm: 1}", {{"touch_sd", {1, 0}}}},
      {"touch-sd-mm", "0", "touch_sd: {mm: 0}", json::object()},
      {"touch-sd-deg", "5", "touch_sd: {deg: 5}", {{"touch_sd", {0, 5}}}},
      {"slip-sd-mm", "0.5", "slip_sd: {mm: 0.5}",
       R"({"slip_sd": [0.5, 0], "by_place": false})"_json, "histogram"},
      {"slip-sd-deg", "9", "slip_sd: {deg: 9}", R"({"slip_sd": [0, 9], "by_place": false})"_json,
       "histogram"},
      {"slip-sd-mm", "0.5", "slip_sd: {mm: 0.5}", {{"motion", {0.5, 5.729577951}}}, "particles"},
      {"slip-sd-deg", "9", "slip_sd: {deg: 9}", {{"motion", {1, 9}}}, "particles"},
      {"none", "0.5", "none: 0.5", {{"none", 0.5}}},
      {"none", "auto", "none: auto", json::object()},
      {"none", "0", "none: 0", {{"none", nullptr}, {"labels", {"A", "I"}}, {"by_place", false}}},
      {"none", "0", "none: 0", {{"by_place", false}}, "particles"},
      {"act-below-mm", "0.3", "act_below_mm: 0.3", {{"act", {0.3, 0.99}}}},
      {"act-above", "0.9", "act_above: 0.9", {{"act", {0.5, 0.9}}}},
      {"tolerance", "1e-3", "",
       R"({"tolerance": 1e-3, "trace_tolerance": null, "drawn_tolerance": null})"_json},
      {"budget-ms", "5", "", {{"budget_s", 0.005}}},
      {"evidence-nats", "0.5", "", {{"evidence_nats", 0.5}}},
      {"particles", "500", "", {{"particles", {500, false, false, 0}}}, "particles"},
      {"resampling", "systematic", "", {{"particles", {10000, true, false, 0}}}, "particles"},
      {"augmented", "true", "", {{"particles", {10000, false, true, 0}}}, "particles"},
      {"seed", "7", "", {{"particles", {10000, false, false, 7}}}, "particles"},
      {"sensor-model", "s.yaml", "sensor_model: s.yaml",
       R"({"threshold": 5, "ratio": 0.6, "gamma": 0.3, "touch_sd": [1, 0], "sensor": 4,
           "evidence_nats": 0.2})"_json},
      // Particles take touches for exact.
      {"sensor-model", "s.yaml", "sensor_model: s.yaml",
       R"({"threshold": 5, "ratio": 0.6, "gamma": 0.3, "sensor": 4})"_json, "particles"}};
  return all;
}

TEST_F(TaskOfFlags, HasThePapersNumbersWhereNoneIsGiven) {
  EXPECT_EQ(task_told({"--bins=20x20x72"}), papers);
  const std::map<std::string, json> changes{
      {"auto", json::object()},
      {"bounded", json::object()},
      {"histogram", {{"filter", 0}, {"tolerance", nullptr}}},
      {"particles", R"({"filter": 2, "tolerance": null, "none": null, "labels": ["A", "I"],
                        "particles": [10000, false, false, 0], "motion": [1, 5.729577951]})"_json}};
  for (const auto& [filter, of_filter] : changes) {
    json expected = papers;
    expected.update(of_filter);
    EXPECT_EQ(task_told({"--bins=20x20x72", "--filter=" + filter}), expected);
    EXPECT_EQ(task_told({"--bins=20x20x72"}, "filter: " + filter), expected);
  }
}

TEST_F(TaskOfFlags, HasTheValueOfEachFlagAndOfItsKey) {
  for (const Wish& wish : wishes()) {
    SCOPED_TRACE(wish.option + " " + wish.value);
    Flags flags{"--filter=" + wish.filter};
    json expected = task_told({"--filter=" + wish.filter, "--bins=20x20x72"});
    if (wish.option != "bins") {
      flags.emplace_back("--bins=20x20x72");
    }
    expected.update(wish.changes);
    if (!wish.scene.empty()) {
      EXPECT_EQ(task_told(flags, wish.scene), expected);
    }
    const bool file = wish.option == "sensor-model";
    flags.push_back("--" + wish.option + "=" +
                    (file ? (folder_ / wish.value).string() : wish.value));
    EXPECT_EQ(task_told(flags), expected);
  }
  for (const Option& option : options()) {
    const std::string name = option.name;
    EXPECT_TRUE(option.of_selection || name == "scene" || name == "device" || name == "filter" ||
                std::ranges::find(wishes(), name, &Wish::option) != wishes().end())
        << name << " has no case above";
  }
  EXPECT_EQ(task_told({"--bins=5x4x3", "--none"})["none"], papers["none"]) << "as asked";
  EXPECT_EQ(request_of({"--device=1"}).device, "1");
  EXPECT_EQ(request_of({}, "device: llvm").device, "llvm");
}

TEST_F(TaskOfFlags, HasFlagsRatherThanTheScenesKeysAndTheSensorModel) {
  const Flags flags{"--threshold=3",  "--ratio=0.2",     "--gamma=0.2",      "--none=auto",
                    "--x-mm=-8:8",    "--y-mm=-7:7",     "--theta-deg=0:90", "--pivot-mm=1,1",
                    "--device=0",     "--touch-sd-mm=2", "--filter=bounded", "--act-above=0.8",
                    "--bins=20x20x72"};
  json expected = task_told(flags);
  EXPECT_EQ(task_told(flags,
                      "{threshold: 90, ratio: 0.9, gamma: 0.9, none: 9, bins: auto, "
                      "region: {x_mm: [8, 9], y_mm: [8, 9], theta_deg: [200, 210], "
                      "pivot_mm: [90, 90]}, touch_sd: {mm: 5}, filter: particles, "
                      "device: none, act_above: 0.5}"),
            expected);
  Flags learned = flags;
  learned.push_back("--sensor-model=" + (folder_ / "s.yaml").string());
  expected.update({{"sensor", 4}, {"evidence_nats", 0.2}});
  EXPECT_EQ(task_told(learned, "sensor_model: missing.yaml"), expected);
  // A key that is not overridden stays beside one that is.
  EXPECT_EQ(task_told({"--touch-sd-mm=1", "--bins=9x9x8"}, "touch_sd: {mm: 5, deg: 5}"),
            task_told({"--touch-sd-mm=1", "--touch-sd-deg=5", "--bins=9x9x8"}));
}

TEST_F(TaskOfFlags, HasTheDefaultLatticeWhereFlagsSayAutoWhateverTheScene) {
  const json automatic = task_told({});
  EXPECT_TRUE(automatic["auto_pivot"]);
  EXPECT_EQ(task_told({"--bins=auto"}, "bins: [5, 5, 4]"), automatic);
  EXPECT_EQ(task_told({"--pivot-mm=auto"}, "region: {pivot_mm: [90, 90]}"), automatic);
  EXPECT_EQ(task_told({}, "{bins: auto, region: {pivot_mm: auto}}"), automatic);
  EXPECT_EQ(task_told({}, "bins: fine"), task_told({"--bins=fine"}));
  EXPECT_NE(task_told({"--bins=fine"})["x"], automatic["x"]);
}

TEST_F(TaskOfFlags, HasTheScenesObjectsAndANinthOfTheirWeightsForNone) {
  const RecognitionJob of_scene(
      request_of({"--bins=20x20x72", "--none"},
                 "objects: [{map: A.map.h5, weight: 3}, {map: I.map.h5, label: roof, symmetry: 4, "
                 "mirror: true}]"),
      std::vector{recording_});
  const RecognitionTask& task = of_scene.task();
  EXPECT_TRUE(setup_words(of_scene).starts_with("2 maps and 1 mirrored, "));
  ASSERT_EQ(task.hypotheses.size(), 3u) << "with a mirrored one";
  EXPECT_EQ(task.hypotheses[0].weight, 3.0);
  EXPECT_EQ(task.labels, (Flags{"A", "roof", "(none)"}));
  EXPECT_EQ(task.hypotheses[1].map.symmetry, 4);
  EXPECT_TRUE(task.hypotheses[2].mirrored);
  EXPECT_NEAR(traits_of(task.filter).none_weight.value(), 4.0 / 9, 1e-12);
  EXPECT_EQ(task.map_paths[2], (folder_ / "I.map.h5").string());
  EXPECT_EQ(job({}, "objects: [{map: missing.map.h5}]").task().map_paths.size(), 2u)
      << "--maps takes the place of objects";
}

TEST_F(TaskOfFlags, HasTheSelectedTouches) {
  using Range = std::pair<std::size_t, std::size_t>;
  for (const auto& [flags, selected] : std::initializer_list<std::pair<Flags, std::vector<Range>>>{
           {{}, {{0, 6}}},
           {{"--frames=2:5"}, {{2, 5}}},
           {{"--touches=4"}, {{0, 4}}},
           {{"--frames=2:6", "--touches=3"}, {{2, 5}}},
           {{"--frames=2:4", "--each-frame"}, {{2, 3}, {3, 4}}}}) {
    Flags all = flags;
    all.emplace_back("--bins=9x9x8");
    const RecognitionJob one = job(all);
    ASSERT_EQ(one.unknowns().size(), selected.size());
    for (std::size_t i = 0; i < selected.size(); ++i) {
      const auto [begin, end] = selected[i];
      const Query& unknown = one.unknowns()[i];
      ASSERT_EQ(unknown.touches.size(), end - begin);
      for (std::size_t k = begin; k < end; ++k) {
        EXPECT_EQ(unknown.touches[k - begin].T_robot_sensor.translation_mm,
                  recording_.T_robot_sensor[k].translation_mm);
      }
      EXPECT_EQ(unknown.frame, selected.size() > 1 ? std::optional(begin) : std::nullopt);
    }
  }
  EXPECT_TRUE(request_of({"--trace"}).trace);
}

TEST_F(TaskOfFlags, HasTheArrayOfTheRecordingUnlessTheSceneHasOne) {
  const std::vector<glm::dvec2> array = recording_.elements_mm;
  for (glm::dvec2& element : recording_.elements_mm) {
    element *= 3.0;  // a wrong array, for the scene to correct
  }
  const RecognitionJob corrected = job({"--bins=9x9x8"}, "array: digitacts");
  EXPECT_TRUE(std::ranges::equal(corrected.unknowns()[0].touches[0].elements_mm, array));
}

}  // namespace palpate::cli::recognition_flags_test
