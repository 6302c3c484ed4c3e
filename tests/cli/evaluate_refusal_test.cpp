// What palpate evaluate says of results that it cannot take.

#include <functional>

#include <gtest/gtest.h>

#include "support/program.hpp"

namespace palpate::evaluate_refusal_test {

using nlohmann::json;

json sound() {
  return {{"recording", "u.h5"},
          {"best", "A"},
          {"identity", {{"A", 0.75}, {"B", 0.25}}},
          {"truth", {{"object", "A"}}}};
}

struct BadRecord {
  std::string name;
  std::function<void(json&)> spoil;
  std::vector<std::string> named;

  friend void PrintTo(const BadRecord& record, std::ostream* out) { *out << record.name; }
};

class BadResult : public ProgramTest, public testing::WithParamInterface<BadRecord> {};

TEST_P(BadResult, IsRefusedByFileRecordAndField) {
  json records = json::array({sound(), sound()});
  put_bytes(folder_ / "good.json", records.dump());
  GetParam().spoil(records[1]);
  put_bytes(folder_ / "bad.json", records.dump());
  std::vector<std::string> named = GetParam().named;
  named.push_back("bad.json: record 1");
  expect_refused({"evaluate", "good.json", "bad.json", "--json", "e.json"}, named);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadResult,
    testing::Values(
        BadRecord{"no_object", [](json& r) { r = 3; }, {"no JSON object but number"}},
        BadRecord{"no_best", [](json& r) { r.erase("best"); }, {"'best' is missing"}},
        BadRecord{"best_is_a_number", [](json& r) { r["best"] = 1; }, {"'best' is number"}},
        BadRecord{"best_without_probability",
                  [](json& r) { r["best"] = "C"; },
                  {"'best' 'C' has no probability"}},
        BadRecord{"no_identity", [](json& r) { r.erase("identity"); }, {"'identity' is missing"}},
        BadRecord{"probability_above_one",
                  [](json& r) { r["identity"]["A"] = 1.5; },
                  {"'identity.A' = 1.5", "give 0 to 1"}},
        BadRecord{"probability_below_zero",
                  [](json& r) { r["identity"]["B"] = -0.25; },
                  {"'identity.B' = -0.25", "give 0 to 1"}},
        BadRecord{"probability_without_a_value",
                  [](json& r) { r["identity"]["A"] = nullptr; },
                  {"'identity.A' is null, not a number"}},
        BadRecord{"sum",
                  [](json& r) { r["identity"]["A"] = 0.5; },
                  {"'identity' sums to 0.75", "sum to 1"}},
        BadRecord{
            "none_out_of_range", [](json& r) { r["none"] = 2; }, {"'none' = 2", "give 0 to 1"}},
        BadRecord{"none_is_a_text", [](json& r) { r["none"] = "?"; }, {"'none' is string"}},
        BadRecord{"fit_is_a_number", [](json& r) { r["fit"] = 1.0; }, {"'fit' is number"}},
        BadRecord{"z_is_a_text", [](json& r) { r["fit"]["z"] = "x"; }, {"'fit.z' is string"}},
        BadRecord{"truth_is_a_text", [](json& r) { r["truth"] = "A"; }, {"'truth' is string"}},
        BadRecord{"truth_without_a_label",
                  [](json& r) { r["truth"] = json::object(); },
                  {"'truth.object' is missing"}},
        BadRecord{"negative_error",
                  [](json& r) { r["error_mm"] = -1.0; },
                  {"'error_mm' = -1 mm", "at least 0"}}),
    [](const auto& test) { return test.param.name; });

class EvaluateRefuses : public ProgramTest {
 protected:
  void expect_content_refused(const std::string& content, std::vector<std::string> named) const {
    put_bytes(folder_ / "bad.json", content);
    named.push_back("bad.json: ");
    expect_refused({"evaluate", "bad.json", "--json", "e.json"}, named);
  }
};

TEST_F(EvaluateRefuses, WhatIsNotJson) {
  expect_content_refused("recordings", {"not JSON at byte 1"});
  expect_content_refused("[" + sound().dump() + ",]", {"not JSON at byte"});
  expect_content_refused(sound().dump() + "\n\n" + sound().dump().substr(0, 20),
                         {"line 3 (record 1) is not JSON"});
  expect_content_refused("[1e999]", {"too large"});
}

TEST_F(EvaluateRefuses, WhatHoldsNoRecords) {
  expect_content_refused("3", {"holds number, not an array of records"});
  expect_content_refused("[]", {"none of 0 record(s) has a true label"});
  expect_content_refused("", {"none of 0 record(s)"});
  expect_content_refused("{\"touch_sd\": {\"mm\": 1}}", {"record 0: field 'best' is missing"});
}

TEST_F(EvaluateRefuses, RecordsWithoutATruth) {
  json record = sound();
  record.erase("truth");
  expect_content_refused(json::array({record, record}).dump(),
                         {"none of 2 record(s) has a true label ('truth')", "name the object"});
}

TEST_F(EvaluateRefuses, MissingFilesAndEmptyFolders) {
  expect_refused({"evaluate", "missing.json"}, {"missing.json: no such file"});
  std::filesystem::create_directory(folder_ / "empty");
  expect_refused({"evaluate", "empty"}, {"empty: a folder without *.json"});
  expect_refused({"evaluate"}, {"RESULTS is required", "palpate evaluate --help"});
}

TEST_F(EvaluateRefuses, AFileTwice) {
  std::filesystem::create_directory(folder_ / "results");
  put_bytes(folder_ / "results/a.json", sound().dump());
  expect_refused({"evaluate", "results/a.json", "results"}, {"results/a.json: given twice"});
}

TEST_F(EvaluateRefuses, ToOverwriteWhatItReads) {
  put_bytes(folder_ / "r.json", sound().dump());
  expect_refused({"evaluate", "r.json", "--json", "./r.json"},
                 {"--json ./r.json", "RESULTS reads", "overwrite"});
}

TEST_F(EvaluateRefuses, OutputsThatCannotBeWritten) {
  put_bytes(folder_ / "r.json", sound().dump());
  expect_refused({"evaluate", "r.json", "--json", "nowhere/e.json"}, {"nowhere", "does not exist"});
}

}  // namespace palpate::evaluate_refusal_test
