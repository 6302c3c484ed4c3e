// The line that shows how far long work is, by a clock that the tests turn.

#include "cli/progress.hpp"

#include <fcntl.h>
#include <pty.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <system_error>

#include <gtest/gtest.h>

namespace palpate::progress_test {

using namespace std::chrono_literals;

/// Progress of some work that is shown on one end of a terminal, or goes into a pipe; the test
/// reads the other end.
class ProgressLine : public testing::Test {
 protected:
  ~ProgressLine() override {
    progress_.reset();
    ::close(reader_);
  }

  /// Throws, and so fails the test, where the machine has no pseudo-terminal to give.
  void begin(bool on_terminal = true) {
    int ends[2];
    const int failed =
        on_terminal ? ::openpty(&ends[0], &ends[1], nullptr, nullptr, nullptr) : ::pipe(ends);
    if (failed != 0) {
      throw std::system_error(errno, std::generic_category(), on_terminal ? "openpty" : "pipe");
    }
    reader_ = ends[0];
    ::fcntl(reader_, F_SETFL, O_NONBLOCK);
    output_.reset(::fdopen(ends[1], "w"));
    progress_ = std::make_unique<cli::Progress>("working", output_.get(), [this] { return now_; });
  }
  void end() { progress_.reset(); }

  /// What was printed since the last call once this is done after so long.
  std::string shown(std::chrono::milliseconds later, double done) {
    now_ += later;
    progress_->show(done);
    return printed();
  }
  std::string printed() const {
    char text[4096];
    const ssize_t got = ::read(reader_, text, sizeof text);
    return {text, got > 0 ? static_cast<std::size_t>(got) : 0};
  }

  cli::Progress::Clock::time_point now_{};

 private:
  int reader_ = -1;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> output_{nullptr, &std::fclose};
  std::unique_ptr<cli::Progress> progress_;
};

TEST_F(ProgressLine, IsShownAfterTwoSecondsAndErased) {
  begin();
  EXPECT_EQ(shown(0ms, 0.0), "");
  EXPECT_EQ(shown(1999ms, 0.25), "");
  EXPECT_EQ(shown(1ms, 0.25), "\rworking  25 %, 6 s left\033[K");
  EXPECT_EQ(shown(99ms, 0.5), "") << "it changes ten times a second";
  EXPECT_NE(shown(1ms, 0.3).find(" 30 %, "), std::string::npos);
  EXPECT_EQ(shown(5900ms, 1.0), "\rworking 100 %, 0 s left\033[K");
  end();
  EXPECT_EQ(printed(), "\r\033[K");
}

TEST_F(ProgressLine, KnowsNoEndBeforeItHasBegun) {
  begin();
  EXPECT_EQ(shown(3s, 0.0), "\rworking   0 %, 3 s so far\033[K");
}

TEST_F(ProgressLine, IsNotShownForShortWorkNorInAFile) {
  for (const bool on_terminal : {true, false}) {
    begin(on_terminal);
    EXPECT_EQ(shown(on_terminal ? 1s : 1h, 0.9), "");
    now_ += 1h;  // none of it is spent on work that is shown
    end();
    EXPECT_EQ(printed(), "");
  }
}

}  // namespace palpate::progress_test
