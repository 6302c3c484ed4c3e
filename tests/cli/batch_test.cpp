#include <algorithm>

#include "batch_folder.hpp"

namespace palpate::batch_test {

using Batch = BatchTest;

TEST_F(Batch, RecordsAreThoseOfRecognizeWithoutTimeAndDevice) {
  const Outcome outcome = palpate(batch("r"));
  EXPECT_EQ(outcome.status, 3) << outcome.err;  // one recording is broken
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("11 unknowns"), outcome.out.npos) << outcome.out;
  EXPECT_NE(outcome.out.find("1 failed"), outcome.out.npos) << outcome.out;
  const std::vector<nlohmann::json> records = parse(merged("r"));
  ASSERT_EQ(records.size(), static_cast<std::size_t>(recordings));
  for (int i = 0; i < recordings; ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(records[i]["recording"], name(i));
    if (i == broken) {
      EXPECT_NE(records[i]["error"].get<std::string>().find(name(i)), std::string::npos);
      continue;
    }
    nlohmann::json alone =
        record({name(i), "--maps", "maps", "--bins", "10x10x10", "--filter", "bounded"});
    alone.erase("seconds");
    alone.erase("device");
    EXPECT_EQ(records[i], alone);
  }
}

TEST_F(Batch, TimesAndDevicesStandBeside) {
  palpate(batch("r"));
  const nlohmann::json run = nlohmann::json::parse(bytes_of(folder_ / "r/runs/000001.json"));
  EXPECT_EQ(run["first"], 3);
  EXPECT_EQ(run["failed"], 1);
  EXPECT_EQ(run["seconds"].size(), 3u);
  EXPECT_EQ(run["device"], "none");
  EXPECT_EQ(bytes_of(folder_ / "r/chunks/000001.ndjson").find("seconds"), std::string::npos);
}

TEST_F(Batch, BoundsNeedNoDevice) {
  const auto batch_of_one = [](const std::string& results, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"batch", "u/00.h5", "-o", results, "--maps", "maps"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  const std::vector<std::string> histogram{"--filter", "histogram", "--bins", "10x10x10"};
  palpate(batch("r"));
  ASSERT_EQ(palpate(batch_of_one("h", histogram)).status, 0);
  const nlohmann::json run = nlohmann::json::parse(bytes_of(folder_ / "h/runs/000000.json"));
  EXPECT_NE(done({"devices"}).find(run["device"].get<std::string>()), std::string::npos);

  const Variable vulkan("PALPATE_VULKAN_LIBRARY", "/nonexistent/libvulkan.so.1");
  EXPECT_EQ(palpate(batch("without")).status, 3) << "one recording is broken";
  EXPECT_EQ(merged("without"), merged("r"));
  expect_failure(1, batch_of_one("d", histogram), {"install libvulkan1"});
  const std::vector<std::string> automatic{"--filter", "bounded", "--bins", "auto"};
  EXPECT_EQ(palpate(batch_of_one("e", automatic)).status, 0);
  std::vector<std::string> slipping = automatic;
  slipping.insert(slipping.end(), {"--slip-sd-mm", "1"});
  expect_failure(1, batch_of_one("f", slipping), {"install libvulkan1"});
}

TEST_F(Batch, FinishedResultsStay) {
  palpate(batch("r"));
  const auto before = content_of(folder_ / "r");
  const auto written = times("r");
  const Outcome again = palpate(batch("r"));
  EXPECT_EQ(again.status, 3);
  EXPECT_NE(again.out.find("11 done before"), again.out.npos) << again.out;
  EXPECT_TRUE(content_of(folder_ / "r") == before);
  EXPECT_TRUE(times("r") == written);
}

TEST_F(Batch, AnObjectNamedErrorIsNoFailure) {
  OccupancyGrid map = sample_map("A");
  map.label = "error";
  write_map(folder_ / "maps/error.map.h5", map);
  EXPECT_NE(palpate(batch("r")).out.find("1 failed"), std::string::npos);
  const Outcome again = palpate(batch("r"));
  EXPECT_NE(again.out.find("1 failed"), std::string::npos) << again.out;
  const Outcome joined = palpate({"merge", "r"});
  EXPECT_EQ(std::ranges::count_if(parse(joined.out),
                                  [](const nlohmann::json& r) {
                                    return r.contains("identity") &&
                                           r["identity"].contains("error");
                                  }),
            recordings - 1);
  EXPECT_NE(joined.err.find("11 of 11 unknowns, 1 failed"), std::string::npos) << joined.err;
}

TEST_F(Batch, ALineThatIsNoRecordIsRefused) {
  palpate(batch("r"));
  const std::filesystem::path chunk = folder_ / "r/chunks/000002.ndjson";
  const std::string whole = bytes_of(chunk);
  const std::string first = whole.substr(0, whole.find('\n') + 1);
  for (const char* line : {"{\"recording\": \"u/07.h5\", \"touc\n", "\n", "7\n"}) {
    put_bytes(chunk, first + line + first);
    expect_failure(2, {"merge", "r"}, {"000002.ndjson", "line 2", "no record", "remove it"});
  }
  put_bytes(chunk, first + first);
  expect_failure(2, batch("r"), {"000002.ndjson", "2 records instead of 3", "remove it"});
}

TEST_F(Batch, ResultsDoNotDependOnThreads) {
  palpate(batch("r", {"--threads", "1"}));
  palpate(batch("s", {"--threads", "5"}));
  EXPECT_EQ(merged("r"), merged("s"));
}

TEST_F(Batch, EveryFilterRecognisesInAnyOrder) {
  for (const std::string filter : {"histogram", "particles", "auto"}) {
    SCOPED_TRACE(filter);
    const std::vector<std::string> inputs{"u/03.h5", "u/01.h5", "u/02.h5"};
    std::vector<std::string> arguments{"batch", "-o",       "r" + filter, "--maps",
                                       "maps",  "--filter", filter,       "--bins",
                                       "8x8x8", "--chunk",  "1"};
    std::vector<std::string> reversed = arguments;
    reversed[2] = "s" + filter;
    arguments.insert(arguments.begin() + 1, inputs.begin(), inputs.end());
    reversed.insert(reversed.begin() + 1, inputs.rbegin(), inputs.rend());
    ASSERT_EQ(palpate(arguments).status, 0);
    ASSERT_EQ(palpate(reversed).status, 0);
    const std::vector<nlohmann::json> a = parse(merged("r" + filter));
    std::vector<nlohmann::json> b = parse(merged("s" + filter));
    std::ranges::reverse(b);
    EXPECT_EQ(a, b);
  }
}

TEST_F(Batch, EveryTouchMayBeAnUnknown) {
  const Outcome outcome = palpate(batch("r", {"--each-frame", "--frames", "1:4"}));
  EXPECT_EQ(outcome.status, 3) << outcome.err;
  const std::vector<nlohmann::json> records = parse(merged("r"));
  ASSERT_EQ(records.size(), 10u * 3u + 1u);  // a broken recording is one unknown
  EXPECT_EQ(records[2]["recording"], name(0));
  EXPECT_EQ(records[2]["frame"], 3);
  EXPECT_EQ(records[3]["recording"], name(1));
}

TEST_F(Batch, TheRegionFollowsFromAllRecordings) {
  // The second array reaches further than the first, and so does the region of all.
  Recording wide = sample_unknown("A", {}, 3);
  for (glm::dvec2& element : wide.elements_mm) {
    element *= 1.5;
  }
  write_recording(folder_ / "wide.h5", wide);
  const std::vector<std::string> flags{"--maps", "maps", "--filter", "bounded"};
  std::vector<std::string> arguments{"batch", "u/00.h5", "wide.h5", "-o", "r", "--chunk", "1"};
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  ASSERT_EQ(palpate(arguments).status, 0);
  arguments = {"u/00.h5", "wide.h5"};
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  nlohmann::json together = records(arguments);
  for (nlohmann::json& one : together) {
    one.erase("seconds");
    one.erase("device");
  }
  EXPECT_EQ(nlohmann::json(parse(merged("r"))), together);
}

TEST_F(Batch, AManifestSelectsFramesAndNamesLabels) {
  put_bytes(folder_ / "u/list.csv", "path,frames,label\n00.h5,1:3,E\n01.h5,,\n00.h5,0:1,A\n");
  ASSERT_EQ(palpate(batch("r", {}, "u/list.csv")).status, 0);
  const std::vector<nlohmann::json> records = parse(merged("r"));
  ASSERT_EQ(records.size(), 3u);
  EXPECT_EQ(records[0]["recording"], name(0));  // paths are relative to the manifest
  EXPECT_EQ(records[0]["touches"], 2);
  EXPECT_EQ(records[0]["truth"]["object"], "E");
  EXPECT_EQ(records[1]["touches"], 5);
  EXPECT_EQ(records[2]["touches"], 1);
  EXPECT_TRUE(records[2]["truth"].contains("T_robot_object")) << "the label is the recording's own";
}

TEST_F(Batch, AManifestIsRefusedByItsColumns) {
  const auto refused = [&](const std::string& text, const std::vector<std::string>& named) {
    put_bytes(folder_ / "list.csv", text);
    expect_refused(batch("r", {}, "list.csv"), named);
  };
  refused("file,label\na.h5,A\n", {"list.csv", "column 'file'", "path"});
  refused("label\nA\n", {"list.csv", "column 'path' is missing"});
  refused("path,frames\na.h5,5:2\n", {"list.csv:2", "column 'frames'", "5:2"});
  refused("path,label\n,A\n", {"list.csv:2", "column 'path' is empty"});
  refused("path\n", {"list.csv", "names no recording"});
}

TEST_F(Batch, PatternsAndFoldersAreListedByName) {
  write_map(folder_ / "u/Z.map.h5", sample_map("A"));
  palpate(batch("r"));
  palpate(batch("s", {}, "u/??.h5"));
  EXPECT_EQ(merged("r"), merged("s"));
  expect_refused(batch("t", {}, "u/*.h6"), {"u/*.h6", "no file matches"});
  std::filesystem::create_directories(folder_ / "empty");
  expect_refused(batch("t", {}, "empty"), {"empty", "without recordings"});
}

TEST_F(Batch, ABudgetIsRefused) {
  expect_refused(batch("r", {"--budget-ms", "5"}), {"--budget-ms 5", "clock"});
}

TEST_F(Batch, ARecordingOfAnotherUnitIsARecordWithItsError) {
  Recording raw = sample_unknown("A", {}, 3);
  raw.pressure_unit = "raw";
  write_recording(folder_ / name(1), raw);
  Recording stream = sample_unknown("A", {}, 2);
  stream.rows = "frames";
  write_recording(folder_ / name(2), stream);
  EXPECT_EQ(palpate(batch("r")).status, 3);
  const std::vector<nlohmann::json> records = parse(merged("r"));
  EXPECT_NE(records[1]["error"].get<std::string>().find("pressure_unit"), std::string::npos);
  EXPECT_NE(records[2]["error"].get<std::string>().find("palpate touches"), std::string::npos);
  EXPECT_TRUE(records[3].contains("best"));
  // Each touch has the error, and is called by its number.
  EXPECT_EQ(palpate(batch("s", {"--each-frame", "--frames", "1:3"})).status, 3);
  const std::vector<nlohmann::json> touches = parse(merged("s"));
  for (int i : {2, 3}) {
    EXPECT_TRUE(touches[i].contains("error"));
    EXPECT_EQ(touches[i]["frame"], i - 1);
  }
}

TEST_F(Batch, EvaluateReadsTheFolderAndTheMergedFile) {
  palpate(batch("r"));
  const Outcome folder = palpate({"evaluate", "r", "--json", "-"});
  EXPECT_EQ(folder.status, 0) << folder.err;
  EXPECT_NE(folder.err.find("1 unknown could not be recognised"), folder.err.npos) << folder.err;
  EXPECT_EQ(nlohmann::json::parse(folder.out)["records"], recordings - 1);
  EXPECT_EQ(palpate({"merge", "r", "-o", "all.ndjson"}).status, 0);
  EXPECT_EQ(palpate({"evaluate", "all.ndjson", "--json", "-"}).out, folder.out);
  std::filesystem::remove(folder_ / "r/chunks/000001.ndjson");
  const Outcome part = palpate({"evaluate", "r"});
  EXPECT_NE(part.err.find("1 of 4 chunks are missing"), part.err.npos) << part.err;
}

}  // namespace palpate::batch_test
