#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include <fmt/format.h>

#include "fake_serial_board.hpp"
#include "fake_takktile.hpp"
#include "ordinary_user.hpp"
#include "palpate/driver.hpp"
#include "support/child_process.hpp"
#include "support/errors.hpp"

namespace palpate::refusal_test {

using Layout = FakeTakktile::Layout;

class Refusal : public testing::Test {
 protected:
  /// The message with which open_board() fails.
  static std::string refusal(Fault fault, const std::string& name = "takktile") {
    return error_of(fault, [&] { open_board(name); });
  }

  FakeUsb usb_;
};

TEST_F(Refusal, MissingPermissionNamesTheRuleAndHowToInstallIt) {
  FakeTakktile board(usb_, "1", {0b11111});
  board.usb().forbid();
  const OrdinaryUser user;
  const std::string message = refusal(Fault::system);
  expect_named(message, {"no permission", "/dev/bus/usb/001/002", "udevadm control --reload"});
  // The message names a file that exists.
  const std::size_t begin = message.find("sudo cp ") + 8;
  const std::string rule = message.substr(begin, message.find(' ', begin) - begin);
  EXPECT_EQ(access(rule.c_str(), R_OK), 0) << rule;
  const BoardInfo info = list_boards().at(0);
  EXPECT_FALSE(info.usable);
  EXPECT_EQ(info.serial, "1") << "the kernel tells it to everybody";
  expect_named(info.reason, {"70-palpate.rules"});
}

/// Another program that has the board open.
class OtherProgram {
 public:
  explicit OtherProgram(const std::string& node) {
    int pipe_ends[2] = {};
    EXPECT_EQ(pipe(pipe_ends), 0);
    id_ = start_child([&] {
      const bool opened = open(node.c_str(), O_RDWR) >= 0;
      (void)!write(pipe_ends[1], &opened, 1);
      pause();
    });
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
  FakeTakktile board(usb_, "1", {0b11111}, Layout::bits, 99);
  board.usb().occupy(true);
  {
    const OtherProgram other(board.usb().node());
    const std::string who = fmt::format("usb_tests (process {})", other.id());
    expect_named(refusal(Fault::system),
                 {"interface 0 cannot be claimed", ("in use by " + who).c_str()});
    const BoardInfo info = list_boards().at(0);
    EXPECT_FALSE(info.usable);
    expect_named(info.reason, {who.c_str()});
  }
  expect_named(refusal(Fault::system), {"another program"});  // whose files may not be ours to see
  board.usb().occupy(false);
  EXPECT_NO_THROW(open_board("takktile"));
}

TEST_F(Refusal, TheListNamesWhoHasASerialBoard) {
  const FakeSerialBoard board(usb_, "1", {});
  const OtherProgram other(board.node());
  const BoardInfo info = list_boards().at(0);
  EXPECT_FALSE(info.usable);
  expect_named(info.reason, {fmt::format("usb_tests (process {})", other.id()).c_str()});
}

TEST_F(Refusal, NamesThatAreNoBoardOrSeveralAreTheUsersMistake) {
  expect_named(refusal(Fault::input), {"'takktile'", "not plugged in"});
  FakeTakktile one(usb_, "1", {0b11111});
  EXPECT_NO_THROW(open_board("takktile:1"));
  FakeTakktile two(usb_, "2", {0b11111}, Layout::bits, 3);
  expect_named(refusal(Fault::input), {"takktile:1", "takktile:2"});
  expect_named(refusal(Fault::input, "takktile:3"), {"'takktile:3'"});
  expect_named(refusal(Fault::input, "toktile"), {"toktile", "takktile", "tsf85"});
  expect_named(refusal(Fault::input, ""), {"''"});
  expect_named(refusal(Fault::input, "takktile:"), {"'takktile:'"});
  expect_named(refusal(Fault::input, "no/such.yaml"), {"no/such.yaml"});
  expect_named(refusal(Fault::input, "no/such.yaml:1"), {"no/such.yaml: "});
}

TEST_F(Refusal, ABoardThatRefusesItsRequestsDoesNotAnswerOrHasNoCells) {
  FakeTakktile board(usb_, "1", {0b11111});
  board.usb().behave(FakeUsbDevice::Manner::refuses);
  expect_named(refusal(Fault::system), {"0x5C", "refuses"});
  EXPECT_FALSE(board.usb().seen().claimed) << "given back";
  board.usb().behave(FakeUsbDevice::Manner::ignores);
  expect_named(refusal(Fault::system), {"does not answer"});
  EXPECT_EQ(board.usb().seen().urbs_under_way, 0U);
  board.usb().behave(FakeUsbDevice::Manner::answers);
  board.replace_cells({});
  refusal(Fault::system);
  EXPECT_FALSE(list_boards().at(0).usable);
}

}  // namespace palpate::refusal_test
