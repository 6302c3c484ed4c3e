#include "surprise.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "displacement_points.hpp"
#include "interpolated_map.hpp"
#include "predicted_readings.hpp"
#include "reading_mixture.hpp"
#include "refinement.hpp"

namespace palpate {

namespace {

constexpr std::uint64_t seed = 0;

}  // namespace

std::size_t surprise_samples(std::size_t elements) {
  constexpr std::size_t most = 128;
  constexpr std::size_t least = 32;
  constexpr std::size_t readings = most * 288;  // as many as take about 1 ms
  return std::clamp(readings / std::max<std::size_t>(elements, 1), least, most);
}

std::optional<double> surprise_of(const Touch& touch, std::span<const PoseSample> samples,
                                  const RecognitionTask& task) {
  if (std::holds_alternative<ParticleOptions>(task.filter)) {
    return {};
  }
  const DisplacementSd touch_sd = task.touch_sd();
  const DisplacementSd slip_sd = task.slip_sd();
  ContactModel contact = task.contact();
  contact.prior = contact.prior.value_or(task.hypotheses.front().compared().prior);
  std::vector<glm::dvec2> elements_mm;
  std::vector<Reading> readings;
  const std::vector<Reading> classes = contact.classify(touch);
  for (std::size_t e = 0; e < classes.size(); ++e) {
    if (classes[e] != Reading::unknown) {
      elements_mm.push_back(touch.elements_mm[e]);
      readings.push_back(classes[e]);
    }
  }
  if (readings.empty()) {
    return {};
  }
  std::vector<InterpolatedMap> maps;
  std::vector<glm::dvec2> centroids_mm;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    maps.emplace_back(hypothesis.compared(), *contact.prior);
    centroids_mm.push_back(slip_sd.none() ? glm::dvec2(0.0, 0.0)
                                          : displaced_body(hypothesis.map).centroid_mm);
  }
  Random random(seed, Stream::readings);
  ReadingMixture mixture(samples.size(), readings.size(), reading_levels(contact));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto object = static_cast<std::size_t>(samples[i].object);
    const Pose slip = random_displacement(slip_sd, random);
    const Pose T_object_sensor = slipped(samples[i].T_object_robot, slip, centroids_mm[object]) *
                                 touch.T_robot_sensor * random_displacement(touch_sd, random);
    mixture.set(
        i, reading_log_likelihoods(elements_mm, T_object_sensor, maps[object], contact, object));
  }
  const Moments predicted = predicted_log_mean(mixture, mixture, random);
  return -predicted.deviations(mixture.log_mean(readings));
}

}  // namespace palpate
