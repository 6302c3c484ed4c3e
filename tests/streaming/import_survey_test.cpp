// What an import knows of readings that it takes block by block.

#include <cmath>

#include <gmock/gmock.h>

#include "streaming/import_array.hpp"

namespace palpate::import_survey_test {

using testing::ElementsAre;

TEST(ImportSurvey, IsTheSameForBlocksOfAnySize) {
  const double nan = std::nan("");
  const std::vector<double> rows{3, 200, nan, 1, 210, nan, 2, 205, nan, 9, nan, nan, 1, 200, nan};
  ImportSurvey whole(3);
  whole.add(rows);
  EXPECT_THAT(whole.load(), ElementsAre(0, 10, 5, 8, 0)) << "above the least so far";
  EXPECT_THAT(whole.pressed(), ElementsAre(false, true, true, true, false));
  EXPECT_THAT(whole.read(), ElementsAre(1, 1, 0));
  EXPECT_EQ(whole.whole_up_to(), 210.0);
  for (const std::size_t size : {1, 2, 3}) {
    ImportSurvey blocks(3);
    for (std::size_t row = 0; row < 5; row += size) {
      blocks.add(std::span(rows).subspan(3 * row, 3 * std::min(size, 5 - row)));
    }
    EXPECT_EQ(blocks.load(), whole.load());
    EXPECT_EQ(blocks.read(), whole.read());
  }
}

TEST(ImportSurvey, DeadElementsLoadNothing) {
  ImportSurvey survey(2, {1, 0});
  survey.add(std::vector{1.0, 0.0, 2.5, 4000.0});
  EXPECT_THAT(survey.load(), ElementsAre(0, 1.5F));
  EXPECT_FALSE(survey.whole_up_to());
}

}  // namespace palpate::import_survey_test
