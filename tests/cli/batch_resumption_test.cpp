// palpate batch is killed, meets a full disk, other processes and other inputs.

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <random>

#include "batch_folder.hpp"
#include "recognition/batch/batch_task.hpp"

namespace palpate::batch_resumption_test {

using BatchResumption = BatchTest;

TEST_F(BatchResumption, KilledAtAnyMomentItEndsInTheSameBytes) {
  palpate(batch("undisturbed"));
  const std::string expected = merged("undisturbed");
  constexpr int kills = 12;
  std::minstd_rand random(1);  // the moments differ from run to run all the same
  std::uniform_int_distribution<useconds_t> moment(0, 300'000);
  for (int i = 0; i < kills; ++i) {
    if (i % 4 == 0) {
      std::filesystem::remove_all(folder_ / "r");
    }
    const pid_t pid = start(batch("r", {"--threads", std::to_string(1 + i % 3)}));
    ::usleep(moment(random));
    kill_program(pid);
    if (i % 4 == 3) {
      EXPECT_EQ(palpate(batch("r")).status, 3) << i;
      EXPECT_EQ(merged("r"), expected) << i;
    }
  }
}

TEST_F(BatchResumption, NothingIsDoneTwice) {
  palpate(batch("r"));
  const std::string expected = merged("r");
  const auto before = times("r");
  std::filesystem::remove(folder_ / "r/chunks/000002.ndjson");
  const Outcome outcome = palpate(batch("r"));
  EXPECT_NE(outcome.out.find("8 done before, 3 now"), outcome.out.npos) << outcome.out;
  EXPECT_EQ(merged("r"), expected);
  for (const auto& [file, time] : times("r")) {
    EXPECT_EQ(time == before.at(file), file != "000002.ndjson") << file;
  }
}

TEST_F(BatchResumption, AFullDiskKeepsFinishedChunks) {
  palpate(batch("undisturbed"));
  // The task file is smaller than a chunk of three records.
  const std::uintmax_t task = std::filesystem::file_size(folder_ / "undisturbed/task.ndjson");
  const std::uintmax_t chunk =
      std::filesystem::file_size(folder_ / "undisturbed/chunks/000002.ndjson");
  ASSERT_LT(task, chunk);
  expect_failure(1, batch("r"), {"r/chunks/00000", "write"}, {.largest_file_bytes = task});
  for (const auto& [file, content] : content_of(folder_ / "r")) {
    EXPECT_EQ(file.find(".part"), file.npos) << file;
  }
  EXPECT_EQ(palpate(batch("r")).status, 3);
  EXPECT_EQ(merged("r"), merged("undisturbed"));
}

TEST_F(BatchResumption, ManyProcessesOnOneShardWriteTheBytesOfOne) {
  palpate(batch("alone"));
  for (const char* more : {"0/1", "0/2", "1/2"}) {
    std::vector<pid_t> processes;
    for (int i = 0; i < 4; ++i) {  // from nothing: they meet at the task file
      processes.push_back(start(batch("r", {"--shard", i % 2 == 0 ? "0/1" : more})));
    }
    for (const pid_t pid : processes) {
      int status = 0;
      ::waitpid(pid, &status, 0);
      EXPECT_TRUE(WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 3));
    }
    auto [written, expected] = std::pair(content_of(folder_ / "r"), content_of(folder_ / "alone"));
    std::erase_if(written, [](const auto& file) { return file.first.starts_with("runs"); });
    std::erase_if(expected, [](const auto& file) { return file.first.starts_with("runs"); });
    EXPECT_TRUE(written == expected) << more;
    std::filesystem::remove_all(folder_ / "r");
  }
}

TEST_F(BatchResumption, OfTwoTasksTheFirstStays) {
  const std::filesystem::path file = folder_ / "task.ndjson";
  EXPECT_TRUE(write_batch_task(file, {.program = "a", .chunk_unknowns = 1}));
  EXPECT_FALSE(write_batch_task(file, {.program = "b", .chunk_unknowns = 1}));
  EXPECT_EQ(read_batch_task(file).program, "a");
  for (const auto& [name, content] : content_of(folder_.path())) {
    EXPECT_EQ(name.find(".part"), name.npos) << name;
  }
}

TEST_F(BatchResumption, AFolderThatCannotBeWrittenIsRead) {
  palpate(batch("r"));
  const std::string expected = merged("r");
  const auto set = [&](std::filesystem::perms permissions) {
    for (const char* const folder : {"r/chunks", "r/runs", "r"}) {
      std::filesystem::permissions(folder_ / folder, permissions);
    }
  };
  using std::filesystem::perms;
  const auto outcome_of = [&](const std::vector<std::string>& arguments) {
    set(perms::owner_read | perms::owner_exec);
    const Outcome outcome = palpate(arguments, {.obeys_permissions = true});
    set(perms::owner_all);
    return outcome;
  };
  EXPECT_EQ(outcome_of({"merge", "r"}).out, expected);
  const Outcome complete = outcome_of(batch("r"));
  EXPECT_NE(complete.out.find("11 done before"), complete.out.npos) << complete.err;
  std::filesystem::remove(folder_ / "r/chunks/000002.ndjson");
  const Outcome outcome = outcome_of(batch("r"));
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("cannot create a file in folder"), outcome.err.npos) << outcome.err;
}

TEST_F(BatchResumption, AChangedRecordingIsNoticed) {
  palpate(batch("r"));
  write_recording(folder_ / name(7), sample_unknown("A", {}, 7));
  expect_refused(batch("r"), {"r:", name(7) + " has changed", "another folder"});
}

TEST_F(BatchResumption, OtherFramesOfARecordingAreNoticed) {
  put_bytes(folder_ / "u/list.csv", "path,frames\n00.h5,0:2\n");
  palpate(batch("r", {}, "u/list.csv"));
  put_bytes(folder_ / "u/list.csv", "path,frames\n00.h5,0:3\n");
  expect_refused(batch("r", {}, "u/list.csv"), {"of u/00.h5 with other frames or label"});
}

TEST_F(BatchResumption, MoreRecordingsAreNoticed) {
  palpate(batch("r"));
  write_recording(folder_ / name(11), sample_unknown("E", {}, 4));
  write_recording(folder_ / name(12), sample_unknown("E", {}, 4));
  expect_refused(batch("r"), {"r:", "13 inputs", "11"});
}

TEST_F(BatchResumption, AChangedMapOrFlagIsNoticed) {
  palpate(batch("r"));
  expect_refused(batch("r", {"--gamma", "0.2"}),
                 {"r:", "--gamma is '0.2'", "not given", "another folder"});
  OccupancyGrid map = sample_map("E");
  map.log_odds[40] += 1.0F;
  write_map(folder_ / "maps/E.map.h5", map);
  expect_refused(batch("r"), {"r:", "maps/E.map.h5 has changed", "another folder"});
}

TEST_F(BatchResumption, ShardsShareTheFolderAndTheResultDoesNotDependOnThem) {
  palpate(batch("whole"));
  for (int shard = 2; shard >= 0; --shard) {
    const Outcome outcome = palpate(batch("r", {"--shard", fmt::format("{}/3", shard)}));
    EXPECT_EQ(outcome.status, shard == 1 ? 3 : 0) << outcome.err;  // the broken one is in chunk 1
    if (shard > 0) {
      expect_refused({"merge", "r"}, {"r:", "missing", "unknowns 0 to"});
    }
  }
  EXPECT_EQ(merged("r"), merged("whole"));
  EXPECT_EQ(bytes_of(folder_ / "r/task.ndjson"), bytes_of(folder_ / "whole/task.ndjson"));
}

TEST_F(BatchResumption, APartialMergeSaysWhatIsMissing) {
  palpate(batch("r", {"--shard", "0/2"}));
  const Outcome outcome = palpate({"merge", "r", "--partial"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(parse(outcome.out).size(), 6u);
  EXPECT_NE(outcome.err.find("missing: 3 to 5, 9 to 10"), outcome.err.npos) << outcome.err;
  palpate({"batch", "u", "--chunk", "1", "--shard", "1/2", "-o", "s", "--maps", "maps", "--bins",
           "10x10x10", "--filter", "bounded"});
  expect_refused({"merge", "s"}, {"(unknowns 0 to 0, 2 to 2, 4 to 4, and more)"});
}

// A chunk of another shard may hold some of a recording's touches.
TEST_F(BatchResumption, AShardRecognisesItsOwnUnknownsAlone) {
  const Outcome outcome =
      palpate({"batch", name(1), name(3), "--each-frame", "--chunk", "3", "--shard", "0/2", "-o",
               "r", "--maps", "maps", "--bins", "10x10x10", "--filter", "bounded"});
  EXPECT_NE(outcome.out.find("6 unknowns of shard 0/2, 6 now"), outcome.out.npos) << outcome.out;
}

// Younger ones may be another process's.
TEST_F(BatchResumption, WhatAKilledProcessLeavesIsRemovedAfterADay) {
  palpate(batch("r", {"--shard", "0/2"}));
  const auto now = std::filesystem::file_time_type::clock::now();
  for (const auto& [file, hours] : {std::pair{"r/chunks/.palpate-1-0.part", 25},
                                    {"r/runs/.palpate-1-1.part", 25},
                                    {"r/.palpate-1-2.part", 25},
                                    {"r/chunks/.palpate-1-3.part", 23}}) {
    put_bytes(folder_ / file, "{");
    std::filesystem::last_write_time(folder_ / file, now - std::chrono::hours(hours));
  }
  palpate(batch("r", {"--shard", "1/2"}));
  std::vector<std::string> left;
  for (const auto& [file, content] : content_of(folder_ / "r")) {
    if (file.find(".part") != file.npos) {
      left.push_back(file);
    }
  }
  EXPECT_EQ(left, std::vector<std::string>{"chunks/.palpate-1-3.part"});
}

// Seconds are too coarse for a file that is made again at once.
TEST_F(BatchResumption, ARecordingOfTheSameSizeIsNoticedByItsTime) {
  palpate(batch("r"));
  const auto written = std::filesystem::last_write_time(folder_ / name(7));
  std::filesystem::last_write_time(folder_ / name(7), written + std::chrono::microseconds(1));
  const Outcome outcome = palpate(batch("r"));
  EXPECT_NE(outcome.err.find(name(7) + " has changed"), outcome.err.npos) << outcome.err;
}

TEST_F(BatchResumption, AnyBytesMayBeAPath) {
  std::filesystem::rename(folder_ / name(0), folder_ / "u/\xc3\xbc \x80\xff.h5");
  palpate(batch("r"));
  const Outcome again = palpate(batch("r"));
  EXPECT_NE(again.out.find("11 done before"), again.out.npos) << again.err;
}

TEST_F(BatchResumption, AShardIsOneOfACount) {
  for (const char* const wrong : {"2/2", "1", "a/2", "0/0", "-1/2", "0/1000001", "/"}) {
    expect_refused(batch("s", {"--shard=" + std::string(wrong)}), {"--shard", wrong, "I/N"});
  }
}

}  // namespace palpate::batch_resumption_test
