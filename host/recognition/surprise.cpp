#include "recognition/surprise.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "estimation/hypotheses.hpp"
#include "estimation/lattice/refinement.hpp"
#include "model/displacement_points.hpp"
#include "model/reading_mixture.hpp"

namespace palpate {

namespace {

constexpr std::uint64_t seed = 0;

}  // namespace

std::size_t surprise_samples(std::size_t elements) {
  constexpr std::size_t most = 64;
  constexpr std::size_t least = 32;
  constexpr std::size_t readings = most * 576;  // as many as take about half a millisecond
  return std::clamp(readings / std::max<std::size_t>(elements, 1), least, most);
}

SurpriseJudge::SurpriseJudge(const RecognitionTask& task)
    : touch_sd_(task.touch_sd()),
      slip_sd_(task.slip_sd()),
      contact_(resolve(task.contact(), task.hypotheses)),
      predictor_(task.hypotheses, contact_) {
  for (const Hypothesis& hypothesis : task.hypotheses) {
    centroids_mm_.push_back(slip_sd_.none() ? glm::dvec2(0.0, 0.0)
                                            : displaced_body(hypothesis.map).centroid_mm);
  }
}

std::optional<double> SurpriseJudge::surprise_of(const TouchEvidence& touch,
                                                 std::span<const PoseSample> samples) const {
  const TouchEvidence known = touch.known();
  const std::vector<Reading>& readings = known.readings;
  if (readings.empty()) {
    return {};
  }
  Random random(seed, Stream::readings);
  ReadingMixture mixture(samples.size(), readings.size(), predictor_.levels());
  std::vector<float> logs(readings.size() * predictor_.levels());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto object = static_cast<std::size_t>(samples[i].object);
    Pose T_object_sensor = samples[i].T_object_robot;
    if (!slip_sd_.none()) {
      T_object_sensor =
          slipped(T_object_sensor, random_displacement(slip_sd_, random), centroids_mm_[object]);
    }
    T_object_sensor = T_object_sensor * touch.T_robot_sensor;
    if (!touch_sd_.none()) {
      T_object_sensor = T_object_sensor * random_displacement(touch_sd_, random);
    }
    predictor_.predict(object, T_object_sensor, known.elements_mm, logs, 1);
    mixture.set(i, std::span<const float>(logs));
  }
  const Moments predicted = predicted_log_mean(mixture, mixture, random);
  return -predicted.deviations(mixture.log_mean(readings));
}

}  // namespace palpate
