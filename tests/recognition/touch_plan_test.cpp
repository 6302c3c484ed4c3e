#include "recognition/touch_plan.hpp"

#include <algorithm>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "shapes.hpp"

namespace palpate::touch_plan_test {

TEST(CandidateGrid, HasPlacesThatATenthOfTheBeliefTouches) {
  const RecognitionTask task(shapes(), HistogramOptions{});
  const std::vector<glm::dvec2> array = digitacts_array();
  for (const std::size_t elsewhere : {2U, 1U}) {  // of 15 samples: more and less than a tenth
    std::vector<PoseSample> samples(15);
    for (std::size_t i = 0; i < elsewhere; ++i) {
      samples[i].T_object_robot.translation_mm = {-100.0, 0.0};  // the object lies at x = 100 mm
    }
    const std::vector<Pose> candidates = candidate_grid(samples, task, array, 0.0);
    EXPECT_EQ(candidates.size() % 4, 0u) << "angles";
    const auto is_elsewhere = [&](const Pose& candidate) {
      return glm::length(candidate * array_centre_mm(array) - glm::dvec2(100.0, 0.0)) < 30.0;
    };
    EXPECT_EQ(std::ranges::any_of(candidates, is_elsewhere), elsewhere == 2) << elsewhere;
    EXPECT_FALSE(std::ranges::all_of(candidates, is_elsewhere));
  }
}

}  // namespace palpate::touch_plan_test
