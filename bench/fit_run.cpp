#include "fit_run.hpp"

#include <algorithm>

#include "filter_run.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t learned_seed = 200'000'000;
constexpr std::uint64_t unlearned_seed = 300'000'000;

/// 16 x 16 elements at the pitch of a DigiTacts pad.
std::vector<glm::dvec2> large_array() {
  constexpr int side = 16;
  constexpr double pitch_mm = 1.9;
  constexpr double middle = (side - 1) / 2.0;
  std::vector<glm::dvec2> elements_mm;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      elements_mm.emplace_back((column - middle) * pitch_mm, (row - middle) * pitch_mm);
    }
  }
  return elements_mm;
}

}  // namespace

void Fits::add(const Fit& fit) {
  z.push_back(fit.z);
  ++verdicts[static_cast<std::size_t>(fit.verdict)];
}

double FitRun::told_apart() const { return bench::told_apart(unlearned.z, learned.z); }

Interval FitRun::told_apart_interval() const {
  return bench::told_apart_interval(unlearned.z, learned.z);
}

std::vector<FitSetting> fit_settings() {
  const PoseLattice fine = lattice_of(25, 25, 72);
  const TrialTouches exact{.at_random_poses = true};
  TrialTouches large = exact;
  large.sensor.elements_mm = large_array();
  std::vector<FitSetting> settings{{"6x6 array", fine, exact},
                                   {"16x16 array", fine, large},
                                   {"6x6 array, 25x25x16 bins", lattice_of(25, 25, 16), exact}};
  for (const auto& [name, noise] :
       {std::pair("6x6 array off by 0.5 mm, 0.025 rad", SensorPoseNoise{0.5, 0.025}),
        std::pair("6x6 array off by 1 mm, 0.05 rad", SensorPoseNoise{1.0, 0.05})}) {
    FitSetting& setting = settings.emplace_back(FitSetting{name, fine, exact});
    setting.touching.pose_noise = noise;
  }
  return settings;
}

std::vector<FitRun> run_fit(Device& device, const FitSetting& setting, int trials_each,
                            std::span<const int> touches) {
  const RecognitionTask task(
      letter_maps(device, training_recordings(setting.touching.sensor), MapOptions{}),
      HistogramOptions{.lattice = setting.lattice});
  std::vector<FitRun> runs;
  for (const int n : touches) {
    runs.push_back({.touches = n});
  }
  const int most = *std::max_element(touches.begin(), touches.end());
  const auto add = [&](std::span<const std::string> shapes, std::uint64_t seed,
                       Fits FitRun::*fits) {
    const std::vector<Recording> trials =
        make_trials(shapes, trials_each, most, seed, setting.touching);
    for (const RecognitionRecord& record : run_filter(device, task, trials).records) {
      for (FitRun& run : runs) {
        (run.*fits).add(record.trace[static_cast<std::size_t>(run.touches) - 1].fit.value());
      }
    }
  };
  add(vowels, learned_seed, &FitRun::learned);
  add(misfits, unlearned_seed, &FitRun::unlearned);
  return runs;
}

}  // namespace palpate::bench
