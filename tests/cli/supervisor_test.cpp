// The process that a command runs in, the one that watches it, and the line that shows how far long
// work is, by a clock that the tests turn.

#include "cli/supervisor.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

#include "cli/progress.hpp"
#include "io/watched_reading.hpp"
#include "palpate/error.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::supervisor_test {

using cli::Restart;

class Supervisor : public testing::Test {
 protected:
  Supervisor() { EXPECT_EQ(::pipe(tells_), 0); }
  ~Supervisor() override {
    for (const int end : tells_) {
      ::close(end);
    }
  }

  /// Starts a process whose command is `work`; status 2 and a line in "complained" where a file is
  /// at fault.
  pid_t start(const std::function<void()>& work, Restart restart = Restart::never,
              std::uint64_t patience_s = 60) const {
    const pid_t pid = ::fork();
    if (pid == 0) {
      std::signal(SIGPIPE, SIG_DFL);  // which a test of a page ignores
      const int complained = ::creat((folder_ / "complained").c_str(), 0600);
      try {
        cli::supervise(restart, patience_s);
        work();
        ::_exit(0);
      } catch (const Error& error) {
        const std::string line = error.what();
        ::_exit(::write(complained, line.data(), line.size()) > 0 ? 2 : 3);
      }
    }
    return pid;
  }

  /// Exit status, or minus the signal that ended the process.
  static int ending(pid_t pid) {
    int status = 0;
    ::waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  int run(const std::function<void()>& work, Restart restart = Restart::never) const {
    return ending(start(work, restart));
  }
  std::string complaint() const { return bytes_of(folder_ / "complained"); }

  void tell() const { EXPECT_EQ(::write(tells_[1], "!", 1), 1); }
  void wait_for_word() const {
    char word = 0;
    EXPECT_EQ(::read(tells_[0], &word, 1), 1);
  }

  ScratchFolder folder_;
  int tells_[2] = {};
};

/// Takes more stack than there is.
int overflow(int depth) {
  volatile char frame[4096] = {};
  frame[depth % 4096] = 1;
  return depth < 0 ? 0 : overflow(depth + 1) + frame[0];
}

TEST_F(Supervisor, EndsAsTheCommandDoes) {
  for (const int status : {0, 1, 2, 3, 77}) {
    EXPECT_EQ(run([&] { ::_exit(status); }), status);
  }
  for (const int signal : {SIGINT, SIGPIPE, SIGTERM, SIGKILL, SIGXFSZ}) {
    EXPECT_EQ(run([&] { ::raise(signal); }), -signal);
  }
  EXPECT_EQ(run([] { std::abort(); }), -SIGABRT);
  EXPECT_EQ(complaint(), "");
}

TEST_F(Supervisor, NamesTheFileThatTakesTheCommandDown) {
  const std::function<void()> crashes[] = {[] { std::abort(); },    [] { ::raise(SIGSEGV); },
                                           [] { ::raise(SIGBUS); }, [] { overflow(0); },
                                           [] { ::_exit(1); },      [] { ::raise(SIGKILL); }};
  for (const auto& crash : crashes) {
    const auto read = [&] {
      { const ReadingMark before("sound.h5"); }
      const ReadingMark mark("a/b.h5");
      crash();
    };
    EXPECT_EQ(run(read), 2);
    EXPECT_TRUE(complaint().starts_with("a/b.h5: ")) << complaint();
  }
}

TEST_F(Supervisor, KnowsWhatIsNoFaultOfAFile) {
  const auto crash_elsewhere = [] {
    const ReadingMark mark("a.h5");
    std::thread([] { std::abort(); }).join();
  };
  EXPECT_EQ(run(crash_elsewhere), -SIGABRT);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) {
    EXPECT_EQ(run([&] {
                const ReadingMark mark("a.h5");
                ::raise(signal);
              }),
              -signal);
  }
  EXPECT_EQ(complaint(), "");
}

TEST_F(Supervisor, StartsTheCommandAgainWithoutItsBrokenFiles) {
  const auto read_all = [] {
    for (const char* file : {"a.h5", "b.h5", "c.h5"}) {
      const ReadingMark mark(file);
      if (file != std::string("b.h5") && fault_known_of(file).empty()) {
        std::abort();
      }
    }
    ::_exit(fault_known_of("b.h5").empty() ? 7 : 8);
  };
  EXPECT_EQ(run(read_all, Restart::without_the_file), 7);
  EXPECT_EQ(run([] { std::abort(); }, Restart::without_the_file), -SIGABRT);
  // Memory may have been short for another reason.
  const auto killed = [] {
    const ReadingMark mark("a.h5");
    ::raise(SIGKILL);
  };
  EXPECT_EQ(run(killed, Restart::without_the_file), 2);
}

TEST_F(Supervisor, EndsACommandThatHangsInAFile) {
  const auto hang = [&] {
    if (!fault_known_of("a.h5").empty()) {
      ::_exit(7);
    }
    for (int step = 0; step < 3; ++step) {
      begin_reading_step(0);  // outside of a file
    }
    const ReadingMark mark("a.h5");
    for (;;) {
      ::pause();
    }
  };
  EXPECT_EQ(ending(start(hang, Restart::without_the_file, 1)), 7);
}

TEST_F(Supervisor, PassesSignalsOn) {
  static int received = 0;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1}) {
    const pid_t pid = start([&] {
      std::signal(signal, [](int) { received = 1; });
      sigset_t set;
      sigset_t before;
      sigemptyset(&set);
      sigaddset(&set, signal);
      ::sigprocmask(SIG_BLOCK, &set, &before);
      tell();
      while (received == 0) {
        ::sigsuspend(&before);
      }
      ::_exit(7);
    });
    wait_for_word();
    ::kill(pid, signal);
    EXPECT_EQ(ending(pid), 7) << signal;
  }
}

TEST_F(Supervisor, StopsAndGoesOnWithTheCommand) {
  const pid_t pid = start([] {
    ::raise(SIGSTOP);
    ::_exit(7);
  });
  int status = 0;
  ::waitpid(pid, &status, WUNTRACED);
  ASSERT_TRUE(WIFSTOPPED(status));
  ::kill(pid, SIGCONT);
  EXPECT_EQ(ending(pid), 7);
}

TEST_F(Supervisor, TakesTheCommandWithItWhenItIsKilled) {
  const pid_t pid = start([&] {
    tell();
    for (;;) {
      ::pause();
    }
  });
  wait_for_word();
  ::kill(pid, SIGKILL);
  EXPECT_EQ(ending(pid), -SIGKILL);
  ::close(std::exchange(tells_[1], -1));
  char none = 0;
  EXPECT_EQ(::read(tells_[0], &none, 1), 0) << "once nobody has the other end any more";
}

TEST_F(Supervisor, AFileDumpsNoCoreAndHasTheMachinesMemory) {
  const auto limits = [] {
    rlimit memory{};
    ::getrlimit(RLIMIT_DATA, &memory);
    return std::pair(::prctl(PR_GET_DUMPABLE), memory.rlim_cur);
  };
  EXPECT_EQ(run([&] {
              const auto before = limits();
              {
                const ReadingMark mark("a.h5");
                const auto [dumpable, memory] = limits();
                if (dumpable != 0 || memory > before.second || memory == RLIM_INFINITY) {
                  ::_exit(8);
                }
              }
              ::_exit(limits() == before ? 7 : 9);
            }),
            7);
}

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
  begin();
  EXPECT_EQ(shown(3s, 0.0), "\rworking   0 %, 3 s so far\033[K") << "no end is known yet";
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

}  // namespace palpate::supervisor_test
