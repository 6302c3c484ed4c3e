// The line that shows how far long work is, by a clock that the tests turn.

#include "cli/progress.hpp"

#include <fcntl.h>
#include <pty.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <memory>
#include <system_error>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::progress_test {

using namespace std::chrono_literals;

/// Two ends of a terminal or of a pipe: what is printed into one is read from the other.
class Ends {
 public:
  static Ends of_terminal() {
    int ends[2];
    require(::openpty(&ends[0], &ends[1], nullptr, nullptr, nullptr), "openpty");
    return Ends(ends);
  }
  static Ends of_pipe() {
    int ends[2];
    require(::pipe(ends), "pipe");
    return Ends(ends);
  }
  ~Ends() { ::close(reader_); }
  Ends(const Ends&) = delete;
  Ends& operator=(const Ends&) = delete;

  std::FILE* output() const { return output_.get(); }

  /// What was printed since the last call.
  std::string printed() const {
    char text[4096];
    const ssize_t got = ::read(reader_, text, sizeof text);
    return {text, got > 0 ? static_cast<std::size_t>(got) : 0};
  }

 private:
  explicit Ends(const int (&ends)[2])
      : reader_(ends[0]), output_(::fdopen(ends[1], "w"), &std::fclose) {
    require(::fcntl(reader_, F_SETFL, O_NONBLOCK), "fcntl");
  }
  static void require(int result, const char* call) {
    if (result != 0) {
      throw std::system_error(errno, std::generic_category(), call);
    }
  }

  int reader_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> output_;
};

class ProgressLine : public testing::Test {
 protected:
  std::unique_ptr<cli::Progress> begin(const Ends& ends) {
    return std::make_unique<cli::Progress>("working", ends.output(), [this] { return now_; });
  }

  cli::Progress::Clock::time_point now_{};
};

TEST_F(ProgressLine, IsShownAfterTwoSecondsAndErased) {
  const Ends terminal = Ends::of_terminal();
  auto progress = begin(terminal);
  progress->show(0.0);
  now_ += 1999ms;
  progress->show(0.25);
  EXPECT_EQ(terminal.printed(), "");
  now_ += 1ms;
  progress->show(0.25);
  EXPECT_EQ(terminal.printed(), "\rworking  25 %, 6 s left\033[K");
  now_ += 6s;
  progress->show(1.0);
  EXPECT_EQ(terminal.printed(), "\rworking 100 %, 0 s left\033[K");
  progress.reset();
  EXPECT_EQ(terminal.printed(), "\r\033[K");
}

TEST_F(ProgressLine, ChangesTenTimesASecond) {
  const Ends terminal = Ends::of_terminal();
  const auto progress = begin(terminal);
  now_ += 3s;
  progress->show(0.1);
  EXPECT_NE(terminal.printed(), "");
  now_ += 99ms;
  progress->show(0.2);
  EXPECT_EQ(terminal.printed(), "");
  now_ += 1ms;
  progress->show(0.3);
  EXPECT_NE(terminal.printed().find(" 30 %, "), std::string::npos);
}

TEST_F(ProgressLine, KnowsNoEndBeforeItHasBegun) {
  const Ends terminal = Ends::of_terminal();
  const auto progress = begin(terminal);
  now_ += 3s;
  progress->show(0.0);
  EXPECT_EQ(terminal.printed(), "\rworking   0 %, 3 s so far\033[K");
}

TEST_F(ProgressLine, IsNotShownForShortWork) {
  const Ends terminal = Ends::of_terminal();
  auto progress = begin(terminal);
  now_ += 1s;
  progress->show(0.9);
  now_ += 1h;  // none of it is spent on work that is shown
  progress.reset();
  EXPECT_EQ(terminal.printed(), "");
}

TEST_F(ProgressLine, IsNotShownInAFile) {
  const Ends pipe = Ends::of_pipe();
  auto progress = begin(pipe);
  now_ += 1h;
  progress->show(0.5);
  progress.reset();
  EXPECT_EQ(pipe.printed(), "");
}

class ProgressOfTheProgram : public ProgramTest {};

TEST_F(ProgressOfTheProgram, LeavesStandardErrorEmpty) {
  write_map(folder_ / "A.map.h5", sample_map("A"));
  write_recording(folder_ / "u.h5", sample_unknown("A", {}, 3));
  done({"recognize", "u.h5", "--maps", "A.map.h5", "--bins", "5x5x4", "--each-frame"});
}

// A touch says next to nothing with this gamma, so that bounds evaluate nearly all of 2.6e10 bins.
TEST_F(ProgressOfTheProgram, ShowsAnUnknownThatIsSearchedUntilCtrlC) {
  write_map(folder_ / "A.map.h5", sample_map("A"));
  write_recording(folder_ / "u.h5", sample_unknown("A", {}, 3));
  ProgramOnTerminal program(
      folder_.path(),
      {"recognize", "u.h5", "--maps", "A.map.h5", "--each-frame", "--filter", "bounded", "--gamma",
       "0.45", "--x-mm=-60:60", "--y-mm=-60:60", "--bins", "6000x6000x720", "--json", "-"});
  EXPECT_TRUE(program.shows("\rrecognising   0 %, 0 % of unknown 1 of 3, "));
  EXPECT_TRUE(program.shows(" s so far"));
  program.type("\x03");
  const Outcome outcome = program.finish();
  EXPECT_EQ(outcome.status, -SIGINT);
  EXPECT_EQ(outcome.out.find('{'), std::string::npos) << "JSON comes whole or not at all";
}

}  // namespace palpate::progress_test
