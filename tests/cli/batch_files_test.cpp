// Which files palpate batch and merge write over, and what a task file from elsewhere may say.

#include "batch_folder.hpp"

namespace palpate::batch_files_test {

namespace fs = std::filesystem;

class BatchFiles : public BatchTest {
 protected:
  /// A results folder of one recording without results, as somebody else may have made it.
  void make_task(const std::string& head, const std::string& input) const {
    fs::create_directories(folder_ / "r/chunks");
    put_bytes(folder_ / "r/task.ndjson",
              fmt::format(R"({{"format":"palpate.batch","version":4,"program":"0","inputs":1,)"
                          R"("unknowns":1,{},"maps":[],"files":{{}},"pressure_unit":"kPa",)"
                          R"("unit_from":"","reach_mm":1,"bins":[1,1,1]}})"
                          "\n{}\n",
                          head, input));
  }
};

TEST_F(BatchFiles, AFolderThatIsNotItsOwnIsLeftAlone) {
  for (const char* file : {"r/chunks/000000.ndjson", "r/runs/000001.json", "r/notes.txt"}) {
    fs::create_directories((folder_ / file).parent_path());
    put_bytes(folder_ / file, "of somebody else\n");
    expect_refused(batch("r"), {"r:", "holds '" + std::string(file + 2) + "'", "empty or a new"});
    fs::remove_all(folder_ / "r");
  }
  fs::create_directories(folder_ / "r/chunks");
  for (const char* text : {"", "[]\n", "{\"format\":\"palpate.recording\"}\n"}) {
    put_bytes(folder_ / "r/task.ndjson", text);
    put_bytes(folder_ / "r/chunks/000000.ndjson", "of somebody else\n");
    expect_refused(batch("r"), {"r/task.ndjson", "is no task of palpate batch"});
  }
}

TEST_F(BatchFiles, WhatABatchLeavesThatIsKilledEarlyIsItsOwn) {
  fs::create_directories(folder_ / "r/chunks");
  fs::create_directories(folder_ / "r/runs");
  put_bytes(folder_ / "r/.palpate-1-0.part", "{");
  EXPECT_EQ(palpate(batch("r")).status, 3) << "one recording is broken";
}

TEST_F(BatchFiles, OnlyNumberedFilesAreChunks) {
  palpate(batch("r"));
  const std::string expected = merged("r");
  for (const char* name : {"notes.ndjson", "1.ndjson", "000001.ndjson.old", "000001"}) {
    put_bytes(folder_ / "r/chunks" / name, "{}\n");
  }
  EXPECT_EQ(merged("r"), expected);
}

TEST_F(BatchFiles, NoLinkLeadsOutOfTheFolder) {
  palpate(batch("r"));
  const std::string expected = merged("r");
  fs::remove(folder_ / "r/chunks/000001.ndjson");
  for (const char* name : {"runs/000001.json", "chunks/000001.ndjson"}) {
    fs::remove(folder_ / "r" / name);
    fs::create_symlink(folder_ / "outside", folder_ / "r" / name);
  }
  EXPECT_EQ(palpate(batch("r")).status, 3);
  EXPECT_FALSE(fs::exists(folder_ / "outside"));
  for (const char* name : {"runs/000001.json", "chunks/000001.ndjson"}) {
    EXPECT_FALSE(fs::is_symlink(folder_ / "r" / name)) << name;
  }
  EXPECT_EQ(merged("r"), expected);
  for (const char* name : {"chunks", "runs"}) {
    fs::rename(folder_ / "r" / name, folder_ / "moved");
    fs::create_symlink(folder_ / "moved", folder_ / "r" / name);
    expect_refused(batch("r"), {"r/" + std::string(name), "is a link"});
    fs::remove(folder_ / "r" / name);
    fs::rename(folder_ / "moved", folder_ / "r" / name);
  }
}

TEST_F(BatchFiles, MergeAndEvaluateKeepWhatTheyRead) {
  palpate(batch("r"));
  fs::create_symlink(folder_ / "r/chunks/000001.ndjson", folder_ / "link");
  fs::create_hard_link(folder_ / "r/task.ndjson", folder_ / "hard");
  for (const char* name : {"r/task.ndjson", "r/chunks/000000.ndjson", "./r/../link", "hard"}) {
    expect_refused({"merge", "r", "-o", name}, {"-o " + std::string(name), "RESULTS reads"});
  }
  expect_refused({"evaluate", "r", "--json", "r/task.ndjson"}, {"--json", "RESULTS reads"});
  // evaluate would read it beside the chunks.
  expect_refused({"merge", "r", "-o", "r/chunks/all.ndjson"}, {"-o", "among the chunks"});
  fs::remove(folder_ / "r/chunks/000002.ndjson");
  expect_refused({"merge", "r", "--partial", "-o", "r/chunks/000002.ndjson"},
                 {"-o", "among the chunks"});
  EXPECT_EQ(palpate({"merge", "r", "--partial", "-o", "r/all.ndjson"}).status, 0);
}

TEST_F(BatchFiles, ATaskOfAnotherVersionOrWithUnknownOptionsIsRefused) {
  palpate(batch("r"));
  const std::string task = bytes_of(folder_ / "r/task.ndjson");
  const auto with = [&](const std::string& old, const std::string& text) {
    std::string changed = task;
    changed.replace(changed.find(old), old.size(), text);
    put_bytes(folder_ / "r/task.ndjson", changed);
  };
  with("\"version\":4", "\"version\":3");
  expect_refused({"merge", "r"}, {"r/task.ndjson", "of an older palpate", "remove the folder"});
  with("\"version\":4", "\"version\":5");
  expect_refused({"merge", "r"}, {"r/task.ndjson", "use a newer palpate"});
  for (const char* option : {"\"speed\":\"1\",", "\"x-mm\":\"1\",", "\"trace\":\"yes\","}) {
    with("\"options\":{", std::string("\"options\":{") + option);
    expect_refused({"merge", "r"}, {"r/task.ndjson", "is damaged"});
  }
}

// As many chunks as touches: neither command may look for each of them.
TEST_F(BatchFiles, ATaskOfVeryManyChunksTakesNoTime) {
  const auto input = [](const std::string& touches) {
    return R"({"path":"u.h5","survey":[)" + touches + R"(,1,"kPa",""]})";
  };
  const std::string head = R"("chunk_unknowns":1,"options":{"each-frame":"true"})";
  make_task(head, input("1000000000"));
  put_bytes(folder_ / "r/chunks/000007.ndjson", R"({"error":"u.h5: no such file"})"
                                                "\n");
  expect_refused({"merge", "r"}, {"999999999 of 1000000000 chunks are missing",
                                  "(unknowns 0 to 6, 8 to 999999999)"});
  const Outcome part = palpate({"merge", "r", "--partial"});
  EXPECT_EQ(part.status, 0) << part.err;
  EXPECT_NE(part.err.find("1 of 1000000000 unknowns"), part.err.npos) << part.err;
  for (const char* touches : {"1000000001", "1000000000000", "18446744073709551615"}) {
    make_task(head, input(touches));
    expect_refused({"merge", "r"}, {"r/task.ndjson", "more than 1000000000 unknowns", "u.h5"});
  }
  for (const char* touches : {"1e12", "-1", "1e300", "\"1\"", "null", "99999999999999999999"}) {
    make_task(head, input(touches));
    expect_refused({"merge", "r"}, {"r/task.ndjson", "is damaged"});
  }
  make_task(R"("chunk_unknowns":18446744073709551615,"options":{"each-frame":"true"})", input("9"));
  expect_refused({"merge", "r"}, {"1 of 1 chunks are missing", "0 to 8"});
}

TEST_F(BatchFiles, EvaluateCountsMissingChunksAtOnce) {
  palpate(batch("r"));
  std::string task = bytes_of(folder_ / "r/task.ndjson");
  const std::string options = "\"options\":{";
  task.replace(task.find(options), options.size(), options + "\"each-frame\":\"true\",");
  task.replace(task.rfind('}'), 1, ",\"survey\":[900000000,1,\"kPa\",\"\"]}");
  put_bytes(folder_ / "r/task.ndjson", task);
  const Outcome outcome = palpate({"evaluate", "r"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("300000000 of 300000004 chunks"), outcome.err.npos) << outcome.err;
}

}  // namespace palpate::batch_files_test
