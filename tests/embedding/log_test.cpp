#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gpu/context.hpp"
#include "letters.hpp"
#include "model/log_message.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::log_test {

/// Collects the library's messages while it lives.
class Log {
 public:
  Log() {
    set_log([this](LogLevel level, const std::string& message) {
      messages_.emplace_back(level, message);
    });
  }
  ~Log() { set_log({}); }

  /// Expects one message so far, of this level, that names this.
  void expect_one(LogLevel level, const std::string& named) const {
    ASSERT_EQ(messages_.size(), 1U);
    EXPECT_EQ(messages_[0].first, level);
    expect_named(messages_[0].second, {named.c_str()});
  }

 private:
  std::vector<std::pair<LogLevel, std::string>> messages_;
};

TEST(Log, NamesTheDeviceThatIsOpenedUntilNobodyListens) {
  const Log log;
  const Device device = Device::open();
  log.expect_one(LogLevel::info, device.name());
  set_log({});
  log_message(LogLevel::error, "nobody listens");
  log.expect_one(LogLevel::info, device.name());
}

TEST(Log, TellsWhatADestructorCouldNotThrow) {
  std::optional<ScratchFolder> folder(std::in_place);
  const Log log;
  {
    FrameRecorder recorder(*folder / "frames.h5",
                           {.name = "test", .elements_mm = {{0.0, 0.0}}, .rate_hz = 10.0});
    recorder.add({.host_time_s = 1.0, .values = {1.0}});
    folder.reset();  // the recording cannot be closed there
  }
  log.expect_one(LogLevel::error, "frames.h5");
}

TEST(Library, PrintsNothing) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Device device = Device::open();
  const ScratchFolder folder;
  write_map(folder / "map.h5", letter_maps(device).front().map);
  std::filesystem::resize_file(folder / "map.h5", 1000);
  EXPECT_THROW(read_map(folder / "map.h5"), Error);
  EXPECT_THROW(Device::open("no such device"), Error);
  EXPECT_EQ(testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr(), "");
}

TEST(LibraryDeathTest, AMessageOfValidationEndsTheProgramAndIsLogged) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  EXPECT_DEATH(
      {
        set_log([](LogLevel, const std::string& message) {
          std::fprintf(stderr, "logged: %s\n", message.c_str());
        });
        gpu::Instance instance;
        instance.validation().add("a fence was never destroyed");
      },
      "logged: Vulkan validation: a fence was never destroyed");
}

}  // namespace palpate::log_test
