#include <gmock/gmock.h>

#include "letters.hpp"
#include "palpate/rotational_symmetry.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate::turn_warning_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(MeasuredSymmetry, OfLearnedMapsIsTheShapes) {
  Device device = Device::open();
  for (const std::uint64_t seed : {1U, 2U}) {
    // B, M, 8 and Q come close to a symmetry.
    for (const auto& [shape, n] : {std::pair{"A", 1},
                                   {"B", 1},
                                   {"E", 1},
                                   {"H", 2},
                                   {"I", 2},
                                   {"M", 1},
                                   {"O", 0},
                                   {"Q", 1},
                                   {"U", 1},
                                   {"X", 2},
                                   {"8", 1},
                                   {"ring", 0},
                                   {"bar", 2}}) {
      const auto measured = measure_symmetry(learned_map(device, shape, seed));
      ASSERT_TRUE(measured);
      EXPECT_EQ(measured->suggested, n) << shape << ", seed " << seed;
    }
  }
}

class TurnWarning : public testing::Test {
 protected:
  TurnWarning() : maps_(learned_letters(device_)) {}

  /// The warnings after 9 touches of a letter whose map suggests one symmetry and has another; the
  /// truth, if any, is turned by 2 rad.
  std::vector<std::string> warnings(const std::string& letter, int suggested, int symmetry,
                                    bool with_truth) {
    for (Hypothesis& hypothesis : maps_) {
      if (hypothesis.map.label == letter) {
        hypothesis.map.suggested_symmetry = suggested;
        hypothesis.map.symmetry = symmetry;
      }
    }
    const Recording recording = letter_touches(letter, 9, 11);
    Unknown unknown = unknown_of(recording);
    if (with_truth) {
      // Turned in the object frame, about the letter's middle.
      unknown.truth.T_object_robot = Pose{{}, 2.0} * *unknown.truth.T_object_robot;
    } else {
      unknown.truth = {};
    }
    const RecognitionTask task(maps_, HistogramOptions{});
    Recogniser recogniser(device_, task);
    const RecognitionRecord record = recognise(recogniser, task, unknown, false);
    EXPECT_EQ(task.labels[record.last().best], letter);
    return record.last().warnings;
  }

  Device device_ = Device::open();
  std::vector<Hypothesis> maps_;
};

TEST_F(TurnWarning, SaysThatTheBeliefSpreadsOverTurnsThatLookAlike) {
  EXPECT_THAT(warnings("O", 0, 1, false),
              ElementsAre(AllOf(HasSubstr("O looks the same after any turn"),
                                HasSubstr(" % of its belief lies at other such turns"),
                                HasSubstr("with `symmetry 0`"))));
  EXPECT_THAT(warnings("I", 2, 1, false),
              ElementsAre(AllOf(HasSubstr("I looks the same after every 1/2 of a turn"),
                                HasSubstr("with `symmetry 2`"))));
}

TEST_F(TurnWarning, SaysThatAnErrorIsSuchATurn) {
  EXPECT_THAT(warnings("O", 0, 1, true),
              ElementsAre(AllOf(HasSubstr("the pose error of "),
                                HasSubstr(" mm where such turns do not count"))));
}

TEST_F(TurnWarning, IsSilentWhereTheMapKnowsItsSymmetryOrHasNone) {
  EXPECT_THAT(warnings("O", 0, 0, true), IsEmpty());
  EXPECT_THAT(warnings("I", 2, 2, true), IsEmpty());
  EXPECT_THAT(warnings("A", 1, 1, true), IsEmpty());
}

}  // namespace palpate::turn_warning_test
