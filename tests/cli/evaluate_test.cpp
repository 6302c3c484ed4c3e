// palpate evaluate on results written by hand, whose scores are worked out here, and on results
// that it cannot take.

#include <cmath>

#include "recognition/judged_results.hpp"
#include "support/program.hpp"

namespace palpate::evaluate_test {

using nlohmann::json;

json record(const char* truth, const char* best, double a, double b, double none) {
  json record{{"recording", "u.h5"},
              {"best", best},
              {"identity", {{"A", a}, {"B", b}, {"(none)", none}}},
              {"none", none}};
  if (*truth != '\0') {
    record["truth"] = {{"object", truth}};
  }
  return record;
}

/// Two of A, of which one is right, one of M, which no map has, and one without a truth.
json four() {
  json records = json::array({record("A", "A", 0.9, 0.1, 0.0), record("A", "B", 0.25, 0.75, 0.0),
                              record("M", "(none)", 0.2, 0.1, 0.7), record("", "A", 1, 0, 0)});
  records[0]["error_mm"] = 0.5;
  records[0]["refined_error_mm"] = 0.25;
  records[1]["error_mm"] = nullptr;
  return records;
}

class EvaluateCommand : public ProgramTest {
 protected:
  json evaluated(const std::string& results) const {
    return json::parse(done("evaluate " + results + " --json -"));
  }
  json evaluation_of(const json& records) const {
    put_bytes(folder_ / "r.json", records.dump(2));
    return evaluated("r.json");
  }
};

TEST_F(EvaluateCommand, WritesAllNumbersAsJsonAndInWords) {
  const json e = evaluation_of(four());
  json expected = e;
  expected.merge_patch(json::parse(R"json({
      "records": 3, "without_truth": 1, "right": 2, "known_classes": {"records": 2},
      "unknown_classes": {"called_none": 1,
                          "area_under_curve": {"score": "1 - none", "area": 1.0, "known": 2}},
      "confusion": {"rows": ["A", "M"], "columns": ["A", "B", "(none)"],
                    "counts": [[1, 1, 0], [0, 0, 1]]},
      "error_mm": {"records": 1, "median": 0.5},
      "refined_error_mm": {"median": 0.25}})json"));
  EXPECT_EQ(e, expected);
  EXPECT_NEAR(e["accuracy"].get<double>(), 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(e["log_loss"].get<double>(), -std::log(0.9 * 0.25 * 0.7) / 3.0, 1e-12);
  EXPECT_NEAR(e["calibration_error"].get<double>(), (0.1 + 2 * (0.725 - 0.5)) / 3.0, 1e-12)
      << "0.75, which is wrong, and 0.7 share a bin";
  ASSERT_EQ(e["reliability"].size(), 10u);
  EXPECT_EQ(e["reliability"][7]["records"], 2);
  EXPECT_EQ(e["reliability"][7]["accuracy"], 0.5);
  EXPECT_FALSE(e["reliability"][0].contains("accuracy"));
  ASSERT_EQ(e["classes"].size(), 2u);
  EXPECT_EQ(e["classes"][0]["recall"], 0.5);
  EXPECT_EQ(e["classes"][1]["known"], false);

  expect_named(
      done("evaluate r.json"),
      {"66.7 %", "1 record without a true label left out", "0.7 to 0.8", "A", "1 B", "M (unknown)",
       "unknown classes: 1 of 1 called \"(none)\"", "by 1 - none: 1.000 +- 0.000",
       "median error of refined poses 0.25 mm (1 record), of modes 0.50 mm (1 record)"});
  done("evaluate r.json --json e.json");
  EXPECT_EQ(json::parse(bytes_of(folder_ / "e.json")), e);
  evaluation_of(json::array({four()[0]}));
  EXPECT_EQ(done("evaluate r.json").find("nknown"), std::string::npos);
}

TEST_F(EvaluateCommand, ReadsLinesFoldersAndSingleRecords) {
  const json expected = evaluation_of(four());
  std::string lines;
  std::filesystem::create_directory(folder_ / "results");
  for (std::size_t i = 0; i < 4; ++i) {
    lines += four()[i].dump() + "\n\n";
    put_bytes(folder_ / "results" / (std::to_string(i) + ".json"), four()[i].dump(2));
  }
  put_bytes(folder_ / "lines.ndjson", lines);
  put_bytes(folder_ / "results/notes.txt", "no results");
  for (const std::string results :
       {"lines.ndjson", "results", "results/0.json results/1.json results/2.json results/3.json"}) {
    EXPECT_EQ(evaluated(results), expected) << results;
  }
}

const json sound = json::parse(
    R"({"recording": "u.h5", "best": "A", "identity": {"A": 0.75, "B": 0.25}, "truth": {"object": "A"}})");

/// What is said of such a file's text.
std::string refusal_of(const std::string& text) {
  return input_error([&] {
    JudgedResults results;
    add_records("bad.json", text, results);
    evaluate(results, "bad.json");
  });
}

TEST(ResultsThatCannotBeJudged, AreRefusedByFileRecordAndField) {
  const std::pair<const char*, const char*> cases[] = {
      {R"(3)", "no JSON object but number"},
      {R"({"best": null})", "'best' is missing"},
      {R"({"best": 1})", "'best' is 1, not a label"},
      {R"({"best": "C"})", "'best' 'C' has no probability"},
      {R"({"identity": null})", "'identity' is missing"},
      {R"({"identity": {"A": 1.5}})", "'identity.A' = 1.5, not a probability; give 0 to 1"},
      {R"({"identity": {"B": -0.25}})", "'identity.B' = -0.25, not a probability; give 0 to 1"},
      {R"({"identity": {"A": 0.5}})", "'identity' sums to 0.75"},
      {R"({"none": 2})", "'none' = 2, not a probability; give 0 to 1"},
      {R"({"none": "?"})", "'none' is string"},
      {R"({"fit": 1.0})", "'fit' is 1.0, not an object"},
      {R"({"fit": {"z": "x"}})", "'fit.z' is string"},
      {R"({"truth": "A"})", "'truth' is string"},
      {R"({"truth": {"object": null}})", "'truth.object' is missing"},
      {R"({"error_mm": -1.0})", "'error_mm' = -1 mm"}};
  for (const auto& [change, words] : cases) {
    json records = json::array({sound, sound});
    records[1].merge_patch(json::parse(change));
    expect_named(refusal_of(records.dump()), {"bad.json: record 1", words});
  }
  json records = json::array({sound});
  records[0]["identity"]["A"] = nullptr;
  expect_named(refusal_of(records.dump()), {"record 0", "'identity.A' is null, not a number"});
}

TEST(ResultsThatCannotBeJudged, AreTextsWithoutRecords) {
  json nameless = sound;
  nameless.erase("truth");
  const std::pair<std::string, const char*> cases[] = {
      {"recordings", "not JSON at byte 1"},
      {"[" + sound.dump() + ",]", "not JSON at byte"},
      {sound.dump() + "\n\n" + sound.dump().substr(0, 20), "line 3 (record 1) is not JSON"},
      {"[1e999]", "too large"},
      {"3", "holds number, not an array of records"},
      {"[]", "none of 0 record(s) has a true label"},
      {"", "none of 0 record(s)"},
      {R"({"touch_sd": {"mm": 1}})", "record 0: field 'best' is missing"},
      {json::array({nameless, nameless}).dump(),
       "none of 2 record(s) has a true label ('truth'); name the object"}};
  for (const auto& [text, words] : cases) {
    expect_named(refusal_of(text), {"bad.json: ", words});
  }
}

TEST_F(EvaluateCommand, RefusesFilesInOneLine) {
  std::filesystem::create_directory(folder_ / "empty");
  std::filesystem::create_directory(folder_ / "results");
  put_bytes(folder_ / "results/a.json", sound.dump());
  put_bytes(folder_ / "bad.json", "[3]");
  expect_refused("evaluate results/a.json bad.json --json e.json", {"bad.json: record 0"});
  expect_refused("evaluate missing.json", {"missing.json: no such file"});
  expect_refused("evaluate empty", {"empty: a folder without *.json"});
  expect_refused("evaluate", {"RESULTS is required", "palpate evaluate --help"});
  expect_refused("evaluate results/a.json results", {"results/a.json: given twice"});
  expect_refused("evaluate results --json ./results/a.json",
                 {"--json ./results/a.json", "RESULTS reads", "overwrite"});
  expect_refused("evaluate results --json nowhere/e.json", {"nowhere", "does not exist"});
}

}  // namespace palpate::evaluate_test
