// What an import knows of its readings.

#include <gmock/gmock.h>

#include "streaming/import_array.hpp"
#include "support/limits.hpp"

namespace palpate::import_survey_test {

using testing::ElementsAre;

ImportSurvey survey(const std::vector<double>& pressure, std::vector<std::uint8_t> valid) {
  Recording recording;
  recording.elements_mm.resize(valid.size());
  recording.pressure = pressure;
  recording.valid = std::move(valid);
  return survey_of(recording);
}

TEST(ImportSurvey, FindsTheLoadAboveTheLeastSoFarAndWholeNumbers) {
  const ImportSurvey found =
      survey({3, 200, nan, 1, 210, nan, 2, 205, nan, 9, nan, nan, 1, 200, nan}, {1, 1, 1});
  EXPECT_THAT(found.load, ElementsAre(0, 10, 5, 8, 0));
  EXPECT_THAT(found.pressed(), ElementsAre(false, true, true, true, false));
  EXPECT_THAT(found.read, ElementsAre(1, 1, 0));
  EXPECT_EQ(found.whole_up_to, 210.0);
}

TEST(ImportSurvey, DeadElementsLoadNothing) {
  const ImportSurvey found = survey({1.0, 0.0, 2.5, 4000.0}, {1, 0});
  EXPECT_THAT(found.load, ElementsAre(0, 1.5F));
  EXPECT_FALSE(found.whole_up_to);
}

}  // namespace palpate::import_survey_test
