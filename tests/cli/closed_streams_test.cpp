// Standard input, output and error closed, as a daemon's are.

#include <unistd.h>

#include <fstream>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::closed_streams_test {

class ClosedStreams : public ProgramTest {
 protected:
  ClosedStreams() {
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 2));
  }
};

const std::vector<int> every{STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO};

TEST_F(ClosedStreams, NothingPrintedLandsInAFile) {
  for (const std::vector<int>& closed : {std::vector{STDOUT_FILENO}, every}) {
    const Outcome outcome = palpate(
        "live --sensor simulate:A,rate=100,seed=3,touches=2,speed=max --maps A.map.h5"
        " --bins 5x5x4 --json f",
        {.closed = closed});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    std::ifstream file(folder_ / "f");
    int lines = 0;
    for (std::string line; std::getline(file, line); ++lines) {
      EXPECT_TRUE(nlohmann::json::accept(line)) << line;
    }
    EXPECT_EQ(lines, 2);
  }
}

TEST_F(ClosedStreams, FilesAreReadAndWrittenAllTheSame) {
  const char* recognize =
      "recognize u.h5 --maps A.map.h5 --bins 5x5x4 --posterior p.h5 --png sheets";
  EXPECT_EQ(palpate(recognize).status, 0);
  const auto expected = content_of(folder_.path());
  for (const std::vector<int>& closed :
       {std::vector{STDIN_FILENO}, {STDOUT_FILENO}, {STDERR_FILENO}, every}) {
    std::filesystem::remove(folder_ / "p.h5");
    std::filesystem::remove_all(folder_ / "sheets");
    const Outcome outcome = palpate(recognize, {.closed = closed});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(content_of(folder_.path()) == expected);
  }
  EXPECT_EQ(palpate("info missing.h5", {.closed = every}).status, 2);
  EXPECT_EQ(palpate("--version", {.closed = every}).status, 0);
}

}  // namespace palpate::closed_streams_test
