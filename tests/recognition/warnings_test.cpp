// Each warning is provoked on purpose, end to end through recognise(), and good touches give none.

#include "warnings.hpp"

#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include "letters.hpp"
#include "recognition_record.hpp"

namespace palpate {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<std::string> names{"A", "E", "I", "O", "U"};

class Warnings : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    device_ = new Device(Device::open());
    letters_ = new std::vector<Hypothesis>(learned_letters(*device_));
  }
  static void TearDownTestSuite() {
    delete letters_;
    delete device_;
  }

  static RecognitionRecord record_of(const RecognitionTask& task, const Unknown& unknown,
                                     bool trace = false) {
    Recogniser recogniser(*device_, task);
    return recognise(recogniser, task, unknown, trace);
  }
  /// The warnings after all touches of a recording.
  static std::vector<std::string> warnings(const Recording& recording,
                                           const FilterOptions& options = HistogramOptions{},
                                           const std::vector<Hypothesis>& maps = *letters_) {
    const RecognitionRecord record =
        record_of(RecognitionTask(maps, options), unknown_of(recording));
    EXPECT_EQ(record.error, "");
    return record.trace.empty() ? std::vector<std::string>{} : record.last().warnings;
  }
  /// Expects no warning after any touch.
  static void expect_silence(const RecognitionTask& task, const std::string& letter, int touches,
                             std::uint64_t seed) {
    SCOPED_TRACE(fmt::format("{}, seed {}", letter, seed));
    const Recording recording = letter_touches(letter, touches, seed);
    const RecognitionRecord record = record_of(task, unknown_of(recording), true);
    ASSERT_EQ(record.trace.size(), static_cast<std::size_t>(touches));
    for (std::size_t i = 0; i < record.trace.size(); ++i) {
      EXPECT_THAT(record.trace[i].warnings, IsEmpty()) << "after touch " << i + 1;
    }
  }

  static inline Device* device_ = nullptr;
  static inline std::vector<Hypothesis>* letters_ = nullptr;
};

TEST_F(Warnings, GoodTouchesGiveNoneOnTheDefaultLattice) {
  const RecognitionTask task(*letters_, HistogramOptions{});
  for (const std::string& letter : names) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      expect_silence(task, letter, 9, seed);
    }
  }
}

TEST_F(Warnings, GoodTouchesGiveNoneOnBinsThatSuitTheMaps) {
  for (const std::string& letter : names) {
    const Recording recording = letter_touches(letter, 9, 50);
    HistogramOptions options;
    options.lattice.pivot_mm = recording.T_robot_sensor.front().translation_mm;
    options.lattice.x_mm = {-16.0, 16.0, 1};
    options.lattice.y_mm = {-16.0, 16.0, 1};
    RecognitionTask task(*letters_, options);
    task.auto_bins = true;
    settle_bins(*device_, task);
    expect_silence(task, letter, 9, 50);
  }
}

TEST_F(Warnings, GoodSinglePressesGiveNone) {
  const RecognitionTask task(*letters_, HistogramOptions{});
  for (const std::string& letter : names) {
    const Recording recording = letter_touches(letter, 20, 60);
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const Unknown press{.recording = letter, .frame = i, .touches = {recording.touch(i)}};
      EXPECT_THAT(record_of(task, press).last().warnings, IsEmpty()) << letter << " " << i;
    }
  }
}

TEST_F(Warnings, GoodTouchesGiveNoneToParticles) {
  const RecognitionTask task(*letters_, ParticleOptions{.particles = 2000});
  for (const std::string& letter : names) {
    expect_silence(task, letter, 9, 70);
  }
}

}  // namespace
}  // namespace palpate
