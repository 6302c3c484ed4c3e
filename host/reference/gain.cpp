#include <cmath>
#include <map>
#include <vector>

#include "reference/reference.hpp"

namespace palpate::reference {

namespace {

/// q(z_e | i) of every element and level at one pose, [element][level].
std::vector<std::vector<double>> predict(const OccupancyGrid& map, const Pose& T_object_robot,
                                         const Pose& T_robot_sensor, const Pose& displacement,
                                         std::span<const glm::dvec2> elements_mm,
                                         const ContactModel& model, std::size_t object) {
  const std::size_t levels = model.table ? model.table->level_edges.size() + 2 : 2;
  std::vector<std::vector<double>> q;
  for (const glm::dvec2& element : elements_mm) {
    const glm::dvec2 p_object =
        transform(T_object_robot, transform(T_robot_sensor, transform(displacement, element)));
    const MapSample sample{interpolate(map, model.prior.value_or(map.prior), p_object)};
    std::vector<double> likelihoods;
    double sum = 0.0;
    for (std::size_t level = 0; level < levels; ++level) {
      likelihoods.push_back(
          std::exp(log_likelihood(static_cast<Reading>(level), sample, model, object)));
      sum += likelihoods.back();
    }
    for (double& likelihood : likelihoods) {
      likelihood /= sum;
    }
    q.push_back(likelihoods);
  }
  return q;
}

/// f(z | i) of every combination of readings, the first element's level fastest.
std::vector<double> probabilities(const std::vector<std::vector<double>>& q) {
  std::vector<double> f{1.0};
  for (const std::vector<double>& element : q) {
    std::vector<double> longer;
    for (const double level : element) {
      for (const double shorter : f) {
        longer.push_back(shorter * level);
      }
    }
    f = longer;
  }
  return f;
}

}  // namespace

Gain expected_gain(std::span<const BeliefSample> samples, std::span<const OccupancyGrid> maps,
                   const Pose& T_robot_sensor, std::span<const glm::dvec2> elements_mm,
                   const ContactModel& model, std::span<const Pose> displacements) {
  std::vector<std::vector<double>> f;                     // [sample][readings]
  std::map<std::size_t, std::vector<double>> with_label;  // sum of w f
  std::map<std::size_t, double> label_probability;
  std::vector<double> all;
  for (const BeliefSample& sample : samples) {
    std::vector<double> mean;
    for (const Pose& displacement : displacements) {
      const std::vector<double> one =
          probabilities(predict(maps[sample.object], sample.T_object_robot, T_robot_sensor,
                                displacement, elements_mm, model, sample.object));
      mean.resize(one.size());
      for (std::size_t z = 0; z < one.size(); ++z) {
        mean[z] += one[z] / static_cast<double>(displacements.size());
      }
    }
    all.resize(mean.size());
    std::vector<double>& of_label = with_label[sample.label];
    of_label.resize(mean.size());
    label_probability[sample.label] += sample.probability;
    for (std::size_t z = 0; z < mean.size(); ++z) {
      all[z] += sample.probability * mean[z];
      of_label[z] += sample.probability * mean[z];
    }
    f.push_back(mean);
  }
  Gain gain;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t z = 0; z < all.size(); ++z) {
      gain.both += samples[i].probability * f[i][z] * std::log(f[i][z] / all[z]);
    }
  }
  for (const auto& [label, of_label] : with_label) {
    for (std::size_t z = 0; z < all.size(); ++z) {
      gain.identity += of_label[z] * std::log(of_label[z] / label_probability[label] / all[z]);
    }
  }
  return gain;
}

}  // namespace palpate::reference
