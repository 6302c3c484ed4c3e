#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gpu/context.hpp"
#include "letters.hpp"
#include "model/log_message.hpp"

namespace palpate::log_test {

using Messages = std::vector<std::pair<LogLevel, std::string>>;

/// Collects the library's messages while it lives.
class Log {
 public:
  Log() {
    set_log([this](LogLevel level, const std::string& message) {
      messages_.emplace_back(level, message);
    });
  }
  ~Log() { set_log({}); }
  const Messages& messages() const { return messages_; }

 private:
  Messages messages_;
};

TEST(Log, NamesTheDeviceThatIsOpened) {
  const Log log;
  const Device device = Device::open();
  ASSERT_EQ(log.messages().size(), 1U);
  EXPECT_EQ(log.messages()[0].first, LogLevel::info);
  EXPECT_NE(log.messages()[0].second.find(device.name()), std::string::npos)
      << log.messages()[0].second;
}

TEST(Log, DropsMessagesWithoutACallback) {
  Messages before;
  set_log([&](LogLevel level, const std::string& message) { before.emplace_back(level, message); });
  set_log({});
  log_message(LogLevel::error, "nobody listens");
  EXPECT_TRUE(before.empty());
}

TEST(Log, TellsWhatADestructorCouldNotThrow) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("palpate_log_test." + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  const Log log;
  {
    FrameRecorder recorder(folder / "frames.h5",
                           {.name = "test", .elements_mm = {{0.0, 0.0}}, .rate_hz = 10.0});
    recorder.add({.host_time_s = 1.0, .values = {1.0}});
    std::filesystem::remove_all(folder);  // the recording cannot be closed there
  }
  ASSERT_EQ(log.messages().size(), 1U);
  EXPECT_EQ(log.messages()[0].first, LogLevel::error);
  EXPECT_NE(log.messages()[0].second.find("frames.h5"), std::string::npos)
      << log.messages()[0].second;
}

/// What the calls wrote to standard output and standard error.
template <typename Calls>
std::string printed_by(const Calls& calls) {
  std::FILE* const file = std::tmpfile();
  std::fflush(nullptr);
  const int out = dup(STDOUT_FILENO);
  const int err = dup(STDERR_FILENO);
  dup2(fileno(file), STDOUT_FILENO);
  dup2(fileno(file), STDERR_FILENO);
  calls();
  std::fflush(nullptr);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  close(out);
  close(err);
  std::rewind(file);
  std::string text(1 << 16, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  return text;
}

TEST(Library, PrintsNothing) {
  EXPECT_EQ(printed_by([] { std::puts("heard"); }), "heard\n");
  EXPECT_EQ(printed_by([] {
              Device device = Device::open();
              PoseHistogram belief(device, letter_maps(device), {.lattice = small_lattice()});
              belief.update(unknown_letter(3).touch(0));
              belief.refine(belief.estimate().mode);
              EXPECT_THROW(read_recording("/nonexistent.h5"), Error);
              EXPECT_THROW(read_map("/dev/null"), Error);
              EXPECT_THROW(Device::open("no such device"), Error);
            }),
            "");
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
