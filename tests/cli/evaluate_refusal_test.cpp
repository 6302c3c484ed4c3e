// What palpate evaluate says of results that it cannot take.

#include "recognition/judged_results.hpp"
#include "support/program.hpp"

namespace palpate::evaluate_refusal_test {

using nlohmann::json;

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

TEST(EvaluateRefuses, RecordsByFileRecordAndField) {
  const std::pair<const char*, const char*> cases[] = {
      {R"(3)", "no JSON object but number"},
      {R"({"best": null})", "'best' is missing"},
      {R"({"best": 1})", "'best' is number"},
      {R"({"best": "C"})", "'best' 'C' has no probability"},
      {R"({"identity": null})", "'identity' is missing"},
      {R"({"identity": {"A": 1.5}})", "'identity.A' = 1.5, not a probability; give 0 to 1"},
      {R"({"identity": {"B": -0.25}})", "'identity.B' = -0.25, not a probability; give 0 to 1"},
      {R"({"identity": {"A": 0.5}})", "'identity' sums to 0.75"},
      {R"({"none": 2})", "'none' = 2, not a probability; give 0 to 1"},
      {R"({"none": "?"})", "'none' is string"},
      {R"({"fit": 1.0})", "'fit' is number"},
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

TEST(EvaluateRefuses, TextsWithoutRecords) {
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

using EvaluateCommandRefuses = ProgramTest;

TEST_F(EvaluateCommandRefuses, FilesInOneLine) {
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

}  // namespace palpate::evaluate_refusal_test
