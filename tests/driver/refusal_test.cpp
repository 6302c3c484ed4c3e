#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fake_serial_board.hpp"
#include "fake_takktile.hpp"
#include "ordinary_user.hpp"
#include "palpate/driver.hpp"
#include "palpate/error.hpp"

namespace palpate::refusal_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Refusal : public testing::Test {
 protected:
  /// The message of open_board()'s error; "" if it succeeds.
  static std::string refusal(const std::string& name, Fault fault) {
    try {
      open_board(name);
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), fault) << error.what();
      return error.what();
    }
    return "";
  }

  FakeUsb usb_;
};

TEST_F(Refusal, MissingPermissionNamesTheRuleAndHowToInstallIt) {
  FakeTakktile board(usb_, "1", {0b11111});
  board.usb().forbid();
  const OrdinaryUser user(usb_);
  const std::string message = refusal("takktile", Fault::system);
  EXPECT_THAT(message, AllOf(HasSubstr("no permission"), HasSubstr("/dev/bus/usb/001/002"),
                             HasSubstr("sudo cp "), HasSubstr("udevadm control --reload")));
  // The message names a file that exists.
  const std::size_t begin = message.find("sudo cp ") + 8;
  const std::string rule = message.substr(begin, message.find(' ', begin) - begin);
  EXPECT_EQ(access(rule.c_str(), R_OK), 0) << rule;
  const BoardInfo info = list_boards().at(0);
  EXPECT_FALSE(info.usable);
  EXPECT_EQ(info.serial, "1") << "the kernel tells it to everybody";
  EXPECT_THAT(info.reason, HasSubstr("70-palpate.rules"));
}

/// Another program that has the board open.
class OtherProgram {
 public:
  explicit OtherProgram(const std::string& node) {
    int pipe_ends[2] = {};
    EXPECT_EQ(pipe(pipe_ends), 0);
    id_ = fork();
    if (id_ == 0) {
      const bool opened = open(node.c_str(), O_RDWR) >= 0;
      (void)!write(pipe_ends[1], &opened, 1);
      pause();
      _exit(0);
    }
    char opened = 0;
    EXPECT_EQ(read(pipe_ends[0], &opened, 1), 1);
    EXPECT_EQ(opened, 1);
    close(pipe_ends[0]);
    close(pipe_ends[1]);
  }
  ~OtherProgram() {
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  OtherProgram(const OtherProgram&) = delete;
  OtherProgram& operator=(const OtherProgram&) = delete;

  pid_t id() const { return id_; }

 private:
  pid_t id_ = 0;
};

TEST_F(Refusal, ABoardInUseNamesWhoHasIt) {
  // The address is unique: tests that run in parallel have boards open, too.
  FakeTakktile board(usb_, "1", {0b11111}, FakeTakktile::Layout::bits, 99);
  board.usb().occupy(true);
  {
    const OtherProgram other(board.usb().node());
    const std::string who = fmt::format("usb_tests (process {})", other.id());
    EXPECT_THAT(refusal("takktile", Fault::system),
                AllOf(HasSubstr("interface 0 cannot be claimed"), HasSubstr("in use by " + who)));
    const BoardInfo info = list_boards().at(0);
    EXPECT_FALSE(info.usable);
    EXPECT_THAT(info.reason, HasSubstr(who));
  }
  EXPECT_THAT(refusal("takktile", Fault::system), HasSubstr("another program"))
      << "whose files may not be ours to see";
  board.usb().occupy(false);
  EXPECT_EQ(refusal("takktile", Fault::system), "");
}

TEST_F(Refusal, TheListNamesWhoHasASerialBoard) {
  const FakeSerialBoard board(usb_, "1", {});
  const OtherProgram other(board.node());
  const BoardInfo info = list_boards().at(0);
  EXPECT_FALSE(info.usable);
  EXPECT_THAT(info.reason, HasSubstr(fmt::format("usb_tests (process {})", other.id())));
}

TEST_F(Refusal, ABoardThatIsNotThereIsTheUsersMistake) {
  EXPECT_THAT(refusal("takktile", Fault::input),
              AllOf(HasSubstr("'takktile'"), HasSubstr("not plugged in")));
  FakeTakktile board(usb_, "1", {0b11111});
  EXPECT_THAT(refusal("takktile:2", Fault::input), HasSubstr("'takktile:2'"));
  EXPECT_EQ(refusal("takktile:1", Fault::input), "");
}

TEST_F(Refusal, SeveralBoardsAreNamed) {
  FakeTakktile one(usb_, "1", {0b11111});
  FakeTakktile two(usb_, "2", {0b11111}, FakeTakktile::Layout::bits, 3);
  EXPECT_THAT(refusal("takktile", Fault::input),
              AllOf(HasSubstr("takktile:1"), HasSubstr("takktile:2")));
}

TEST_F(Refusal, NamesThatAreNoBoards) {
  EXPECT_THAT(refusal("toktile", Fault::input),
              AllOf(HasSubstr("toktile"), HasSubstr("takktile"), HasSubstr("tsf85")));
  EXPECT_THAT(refusal("", Fault::input), HasSubstr("''"));
  EXPECT_THAT(refusal("takktile:", Fault::input), HasSubstr("'takktile:'"));
  EXPECT_THAT(refusal("no/such.yaml", Fault::input), HasSubstr("no/such.yaml"));
  EXPECT_THAT(refusal("no/such.yaml:1", Fault::input),
              AllOf(HasSubstr("no/such.yaml"), Not(HasSubstr("yaml:1"))));
}

TEST_F(Refusal, ABoardThatRefusesItsRequests) {
  FakeTakktile board(usb_, "1", {0b11111});
  board.usb().refuse_requests(true);
  EXPECT_THAT(refusal("takktile", Fault::system), AllOf(HasSubstr("0x5C"), HasSubstr("refuses")));
  EXPECT_FALSE(board.usb().claimed(0)) << "given back";
}

TEST_F(Refusal, ABoardThatDoesNotAnswer) {
  FakeTakktile board(usb_, "1", {0b11111});
  board.usb().ignore_requests(true);
  EXPECT_THAT(refusal("takktile", Fault::system), HasSubstr("does not answer"));
  EXPECT_EQ(board.usb().urbs_under_way(), 0);
}

TEST_F(Refusal, ABoardWithoutCells) {
  FakeTakktile board(usb_, "1", {});
  EXPECT_NE(refusal("takktile", Fault::system), "");
  EXPECT_FALSE(list_boards().at(0).usable);
}

}  // namespace palpate::refusal_test
