// The process that a command runs in, and the one that watches it.

#include "cli/supervisor.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>

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

}  // namespace palpate::supervisor_test
