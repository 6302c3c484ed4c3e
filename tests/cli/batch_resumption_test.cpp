// palpate batch is killed, meets a full disk, other processes and other inputs.

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <optional>
#include <random>
#include <stdexcept>

#include "batch_folder.hpp"
#include "cli/results_folder.hpp"

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
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
    if (i % 4 == 3) {
      EXPECT_EQ(palpate(batch("r")).status, 3) << i;
      EXPECT_EQ(merged("r"), expected) << i;
      for (const auto& [file, content] : content_of(folder_ / "r")) {
        EXPECT_EQ(file.find(".part"), file.npos) << file;
      }
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

/// Another process that works on a shard, while it lives.
class Worker {
 public:
  Worker(const std::filesystem::path& folder, const cli::Shard& shard) {
    int ends[2];
    if (::pipe(ends) != 0) {
      throw std::runtime_error("no pipe");
    }
    pid_ = ::fork();
    if (pid_ == 0) {
      const cli::FolderLock lock(cli::ResultsFolder(folder), shard);
      ::close(ends[1]);  // tells that it is locked
      ::pause();
    }
    ::close(ends[1]);
    char byte = 0;
    EXPECT_EQ(::read(ends[0], &byte, 1), 0);
    ::close(ends[0]);
  }
  ~Worker() { end(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void end() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
    pid_ = -1;
  }

 private:
  pid_t pid_ = -1;
};

TEST_F(BatchResumption, OfTwoProcessesOnOneShardTheSecondIsRefused) {
  std::filesystem::create_directories(folder_ / "r");
  {
    const Worker worker(folder_ / "r", {1, 2});
    expect_refused(batch("r", {"--shard", "1/2"}), {"r:", "shard 1/2", "wait"});
    const auto refusal_of = [&](const cli::Shard& shard) {
      return input_error([&] {
        const cli::FolderLock lock(cli::ResultsFolder(folder_ / "r"), shard, [] { return false; });
      });
    };
    expect_named(refusal_of({0, 1}), {"r:", "shard 1/2", "--shard I/2"});
    expect_named(refusal_of({2, 3}), {"r:", "shard 1/2"});
    EXPECT_EQ(palpate(batch("r", {"--shard", "0/2"})).status, 0);
    expect_refused(batch("r", {"--shard", "0/2", "--gamma", "0.2", "--update"}),
                   {"r:", "--gamma", "other shards are at work"});
  }
  EXPECT_EQ(palpate(batch("r", {"--shard", "1/2"})).status, 3);  // it has the broken recording
}

// A process that was killed is gone only a moment later.
TEST_F(BatchResumption, AProcessThatEndsIsWaitedFor) {
  std::filesystem::create_directories(folder_ / "r");
  for (const cli::Shard& shard : {cli::Shard{1, 2}, cli::Shard{0, 3}}) {
    Worker worker(folder_ / "r", {1, 2});
    int waits = 0;
    const cli::FolderLock lock(cli::ResultsFolder(folder_ / "r"), shard, [&] {
      if (++waits == 3) {
        worker.end();
      }
      return true;
    });
    EXPECT_EQ(waits, 3);
  }
}

TEST_F(BatchResumption, AProcessThatWaitsKeepsNobodyOut) {
  std::filesystem::create_directories(folder_ / "r");
  std::optional<Worker> other(std::in_place, folder_ / "r", cli::Shard{1, 2});
  int waits = 0;
  const cli::FolderLock lock(cli::ResultsFolder(folder_ / "r"), {0, 3}, [&] {
    other.reset();
    if (++waits == 1) {
      other.emplace(folder_ / "r", cli::Shard{0, 3});  // what is waited for
    }
    return true;
  });
  EXPECT_EQ(waits, 2);
}

TEST_F(BatchResumption, AFolderThatCannotBeWrittenIsRefusedAndRead) {
  palpate(batch("r"));
  const std::string expected = merged("r");
  const auto all = std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec;
  std::filesystem::permissions(folder_ / "r/lock", std::filesystem::perms::owner_read);
  std::filesystem::permissions(folder_ / "r", all);
  expect_failure(2, batch("r"), {"r:", "cannot be written", "palpate merge"},
                 {.obeys_permissions = true});
  const Outcome outcome = palpate({"merge", "r"}, {.obeys_permissions = true});
  std::filesystem::permissions(folder_ / "r", std::filesystem::perms::owner_all);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, expected);
}

TEST_F(BatchResumption, AChangedRecordingIsNoticedAndOnlyItsChunkDoneAgain) {
  palpate(batch("r"));
  const auto before = times("r");
  write_recording(folder_ / name(7), sample_unknown("A", {}, 7));
  expect_refused(batch("r"), {"r:", name(7) + " has changed", "--update"});
  EXPECT_EQ(palpate(batch("r", {"--update"})).status, 3);
  for (const auto& [file, time] : times("r")) {
    EXPECT_EQ(time == before.at(file), file != "000002.ndjson") << file;
  }
  palpate(batch("fresh"));
  EXPECT_EQ(merged("r"), merged("fresh"));
}

TEST_F(BatchResumption, OtherFramesOfARecordingAreNoticed) {
  put_bytes(folder_ / "u/list.csv", "path,frames\n00.h5,0:2\n");
  palpate(batch("r", {}, "u/list.csv"));
  put_bytes(folder_ / "u/list.csv", "path,frames\n00.h5,0:3\n");
  expect_refused(batch("r", {}, "u/list.csv"), {"of u/00.h5 with other frames or label"});
}

TEST_F(BatchResumption, MoreRecordingsKeepTheChunksBeforeThem) {
  palpate(batch("r"));
  const auto before = times("r");
  write_recording(folder_ / name(11), sample_unknown("E", {}, 4));
  write_recording(folder_ / name(12), sample_unknown("E", {}, 4));
  expect_refused(batch("r"), {"r:", "13 inputs", "11"});
  EXPECT_EQ(palpate(batch("r", {"--update"})).status, 3);
  for (const char* const kept : {"000000.ndjson", "000001.ndjson", "000002.ndjson"}) {
    EXPECT_TRUE(times("r").at(kept) == before.at(kept)) << kept;
  }
  palpate(batch("fresh"));
  EXPECT_EQ(merged("r"), merged("fresh"));
}

TEST_F(BatchResumption, AChangedMapOrFlagIsNoticedAndAllDoneAgain) {
  palpate(batch("r"));
  expect_refused(batch("r", {"--gamma", "0.2"}),
                 {"r:", "--gamma is '0.2'", "not given", "--update"});
  EXPECT_EQ(palpate(batch("r", {"--gamma", "0.2", "--update"})).status, 3);
  palpate(batch("fresh", {"--gamma", "0.2"}));
  EXPECT_EQ(merged("r"), merged("fresh"));
  OccupancyGrid map = sample_map("E");
  map.log_odds[40] += 1.0F;
  write_map(folder_ / "maps/E.map.h5", map);
  expect_refused(batch("r", {"--gamma", "0.2"}), {"r:", "maps/E.map.h5 has changed", "--update"});
  EXPECT_EQ(palpate(batch("r", {"--gamma", "0.2", "--update"})).status, 3);
  palpate(batch("newest", {"--gamma", "0.2"}));
  EXPECT_EQ(merged("r"), merged("newest"));
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

TEST_F(BatchResumption, TouchesAsUnknownsMoveFromChunkToChunk) {
  write_recording(folder_ / "two.h5", sample_unknown("A", {}, 2));
  const auto batch_of = [](const std::string& results, std::vector<std::string> inputs) {
    inputs.insert(inputs.begin(), "batch");
    for (const char* more : {"--maps", "maps", "--bins", "10x10x10", "--filter", "bounded",
                             "--each-frame", "--chunk", "2", "--update", "-o"}) {
      inputs.emplace_back(more);
    }
    inputs.push_back(results);
    return inputs;
  };
  const auto expect_as_fresh = [&](const std::vector<std::string>& inputs, const char* why) {
    std::filesystem::remove_all(folder_ / "fresh");
    EXPECT_EQ(palpate(batch_of("r", inputs)).status, 0);
    EXPECT_EQ(palpate(batch_of("fresh", inputs)).status, 0);
    EXPECT_EQ(merged("r"), merged("fresh")) << why;
  };
  palpate(batch_of("r", {name(3), name(1)}));
  expect_as_fresh({name(3), "two.h5", name(1)}, "chunks of u/01.h5 begin two touches earlier");
  write_recording(folder_ / "two.h5", sample_unknown("A", {}, 7));
  expect_as_fresh({name(3), "two.h5", name(1)}, "a recording has more touches");
}

// A chunk of another shard may hold some of a recording's touches.
TEST_F(BatchResumption, AShardRecognisesItsOwnUnknownsAlone) {
  const Outcome outcome =
      palpate({"batch", name(1), name(3), "--each-frame", "--chunk", "3", "--shard", "0/2", "-o",
               "r", "--maps", "maps", "--bins", "10x10x10", "--filter", "bounded"});
  EXPECT_NE(outcome.out.find("6 unknowns of shard 0/2, 6 now"), outcome.out.npos) << outcome.out;
}

TEST_F(BatchResumption, AnotherShardsPartsAreLeftAlone) {
  palpate(batch("r", {"--shard", "0/2"}));
  put_bytes(folder_ / "r/chunks/.palpate-1-0.part", "{");
  {
    const Worker worker(folder_ / "r", {1, 2});
    palpate(batch("r", {"--shard", "0/2"}));
    EXPECT_TRUE(std::filesystem::exists(folder_ / "r/chunks/.palpate-1-0.part"));
  }
  palpate(batch("r", {"--shard", "0/2"}));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "r/chunks/.palpate-1-0.part"));
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

TEST_F(BatchResumption, ATaskOfASlurmArrayIsAShard) {
  palpate(batch("whole"));
  const Variable count("SLURM_ARRAY_TASK_COUNT", "2");
  const Variable least("SLURM_ARRAY_TASK_MIN", "5");
  for (const char* const id : {"5", "6"}) {
    const Variable task("SLURM_ARRAY_TASK_ID", id);
    const Outcome outcome = palpate(batch("r"));
    EXPECT_NE(outcome.out.find(*id == '5' ? "shard 0/2" : "shard 1/2"), outcome.out.npos)
        << outcome.out << outcome.err;
  }
  EXPECT_EQ(merged("r"), merged("whole"));
  {
    const Variable task("SLURM_ARRAY_TASK_ID", "9");
    expect_refused(batch("s"), {"SLURM_ARRAY_TASK_ID 9", "--array=0-1"});
  }
  for (const char* const wrong : {"2/2", "1", "a/2", "0/0", "-1/2"}) {
    expect_refused(batch("s", {"--shard=" + std::string(wrong)}), {"--shard", wrong});
  }
}

TEST_F(BatchResumption, TheTasksOfAStepDivideTheirPart) {
  palpate(batch("whole"));
  const Variable tasks("SLURM_STEP_NUM_TASKS", "2");
  const Variable rank("SLURM_LOCALID", "1");
  const Variable count("SLURM_ARRAY_TASK_COUNT", "2");
  for (const char* const id : {"0", "1"}) {
    const Variable array("SLURM_ARRAY_TASK_ID", id);
    for (const char* const of_step : {"0", "1"}) {
      const Variable task("SLURM_PROCID", of_step);
      const Outcome outcome = palpate(batch("r"));
      const std::string shard = fmt::format("shard {}/4", 2 * (*id - '0') + (*of_step - '0'));
      EXPECT_NE(outcome.out.find(shard), outcome.out.npos) << outcome.out << outcome.err;
    }
  }
  EXPECT_EQ(merged("r"), merged("whole"));
  const Variable task("SLURM_PROCID", "2");
  expect_refused(batch("s"), {"SLURM_PROCID 2", "of 2 tasks"});
  const Variable many("SLURM_ARRAY_TASK_COUNT", "1000000");
  const Variable first("SLURM_ARRAY_TASK_ID", "0");
  const Variable zeroth("SLURM_PROCID", "0");
  expect_refused(batch("s"), {"SLURM_PROCID 0", "of 2 tasks", "1000000"});
}

TEST(LocalDevice, TasksOfAComputerTakeItsEqualDevicesInTurn) {
  const auto device = [](int index, const char* name, bool usable, bool chosen) {
    return DeviceInfo{.index = index,
                      .name = name,
                      .type = "",
                      .driver = "",
                      .api = "",
                      .usable = usable,
                      .chosen = chosen,
                      .reason = ""};
  };
  const std::vector<DeviceInfo> node{device(0, "llvmpipe", true, false),
                                     device(1, "H200", true, true), device(2, "H200", true, false),
                                     device(3, "H200", false, false),
                                     device(4, "H200", true, false)};
  for (const char* const wished : {"", "H2"}) {
    EXPECT_EQ(cli::local_device(node, wished, 0), "1");
    EXPECT_EQ(cli::local_device(node, wished, 1), "2");
    EXPECT_EQ(cli::local_device(node, wished, 2), "4");
    EXPECT_EQ(cli::local_device(node, wished, 3), "1");
  }
  EXPECT_EQ(cli::local_device(node, "1", 2), "1") << "an index is that of one device";
  const std::vector<DeviceInfo> lone{device(0, "llvmpipe", true, true)};
  EXPECT_EQ(cli::local_device(lone, "", 3), "");
}

}  // namespace palpate::batch_resumption_test
