#include "io/forked_child.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "memory_limit.hpp"
#include "scratch_folder.hpp"

namespace palpate::forked_child_test {

using namespace std::chrono_literals;

// More than any child here needs, but for those that never answer.
constexpr ForkedLimits limits{.cpu_seconds = 5, .memory_bytes = 1 << 24, .silence = 60s};

class Forked : public testing::Test {
 protected:
  // The first bytes of what the child answers; "" where that is less.
  std::string answer(const ForkedChild::Work& work, std::size_t bytes = 1,
                     const ForkedLimits& within = limits) {
    ForkedChild child(work, within, mutex_);
    std::string text(bytes, '\0');
    return child.read(text.data(), bytes) ? text : "";
  }

  std::mutex mutex_;
};

TEST_F(Forked, ChildBringsBackWhatItWrote) {
  const std::string sent(1'000'000, 'x');
  EXPECT_EQ(
      answer([&](int socket) { forked_write(socket, sent.data(), sent.size()); }, sent.size()),
      sent);
}

TEST_F(Forked, ChildAnswersRequests) {
  ForkedChild child(
      [](int socket) {
        for (;;) {
          int number = 0;
          forked_read(socket, &number, sizeof number);
          number *= 2;
          forked_write(socket, &number, sizeof number);
        }
      },
      limits, mutex_);
  for (int i = 0; i < 3; ++i) {
    int number = 0;
    ASSERT_TRUE(child.write(&i, sizeof i) && child.read(&number, sizeof number));
    EXPECT_EQ(number, 2 * i);
  }
}

TEST_F(Forked, CallerOutlivesItsChild) {
  EXPECT_EQ(answer([](int) { std::abort(); }), "");
  EXPECT_EQ(answer([](int) { throw std::runtime_error("lost"); }), "");
  EXPECT_EQ(answer([](int) { ::_exit(0); }), "");
}

TEST_F(Forked, ChildThatLoopsIsEndedByItsLimit) {
  const auto loop = [](int) {
    for (volatile bool endless = true; endless;) {
    }
  };
  // Waiting does not end it: the limit of silence is far away.
  EXPECT_EQ(answer(loop, 1, {.cpu_seconds = 1, .memory_bytes = 1 << 24, .silence = 60s}), "");
}

TEST_F(Forked, ChildThatWaitsForEverIsGivenUp) {
  const auto wait = [](int) {
    for (;;) {
      ::pause();
    }
  };
  {
    ForkedChild child(wait, {.cpu_seconds = 5, .memory_bytes = 1 << 24, .silence = 20ms}, mutex_);
    char byte = 0;
    EXPECT_FALSE(child.read(&byte, 1));
    EXPECT_TRUE(child.fell_silent());
  }
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left behind";
}

TEST_F(Forked, ChildThatWritesWithoutEndEndsWithItsReader) {
  const std::string block(1 << 16, 'x');
  const auto flood = [&](int socket) {
    for (;;) {
      forked_write(socket, block.data(), block.size());
    }
  };
  EXPECT_EQ(answer(flood, 1 << 20).size(), std::size_t{1} << 20);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left behind";
}

TEST_F(Forked, MemoryOfTheChildIsBounded) {
  if (!limits_memory()) {
    GTEST_SKIP() << "memory of processes is not limited here";
  }
  const auto take = [](int socket) {
    const std::string large(1 << 27, 'x');  // throws, and the child ends without an answer
    forked_write(socket, large.data(), 1);
  };
  EXPECT_EQ(answer(take), "");
  const auto allowed = [&](int socket) {
    allow_memory_bytes(1 << 28);
    take(socket);
  };
  EXPECT_EQ(answer(allowed), "x");
}

// As in a container without /proc, in a process that has more memory than the child is allowed.
TEST_F(Forked, MemoryThatNobodyTellsIsNotBounded) {
  const ScratchFolder empty;
  constexpr int needs_rights = 77;
  const pid_t pid = ::fork();
  if (pid == 0) {
    if (::chroot(empty.path().c_str()) != 0 &&
        (::unshare(CLONE_NEWUSER) != 0 || ::chroot(empty.path().c_str()) != 0)) {
      ::_exit(needs_rights);
    }
    const std::string got = answer([](int socket) {
      const std::string large(1 << 27, 'x');
      forked_write(socket, large.data(), 1);
    });
    ::_exit(got == "x" ? 0 : 1);
  }
  int status = -1;
  ::waitpid(pid, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) == needs_rights) {
    GTEST_SKIP() << "this user may not change a process's root";
  }
  EXPECT_EQ(status, 0);
}

TEST_F(Forked, LockIsFreeWhileTheChildWorks) {
  const ForkedChild child([](int) { ::pause(); }, limits, mutex_);
  const std::unique_lock lock(mutex_, std::try_to_lock);
  EXPECT_TRUE(lock.owns_lock());
}

}  // namespace palpate::forked_child_test
