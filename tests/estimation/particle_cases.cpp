#include <utility>

#include <fmt/format.h>

#include "beliefs.hpp"
#include "likelihood_cases.hpp"
#include "made_up_sensors.hpp"
#include "support/least_limits.hpp"

namespace palpate {

std::vector<ParticleCase> particle_cases() {
  std::vector<ParticleCase> cases;
  const auto add = [&](std::string name, int particles) -> ParticleCase& {
    return cases.emplace_back(
        ParticleCase{.name = std::move(name),
                     .objects = three_objects(),
                     .recording = random_recording(3, 36, 433),
                     .options = {.particles = particles, .region = {}, .seed = 3}});
  };
  // Around blocks of 64 and 1,024.
  for (const int n : {1, 7, 63, 65, 1000, 1025, 5000}) {
    add(fmt::format("Particles{}", n), n);
  }
  add("Systematic", 3000).options.resampling = Resampling::systematic;
  add("Augmented", 3000).options.augmented = true;
  // 0.07 mm is no binary fraction, and 900 cells make float32 coordinates coarse.
  add("LargeMapOfAlienCells", 3000).objects = {{random_map(900, 700, 0.07, 4.0, 84), 1.0}};
  for (const auto& [gamma, name] : {std::pair(0.1, "ManyElements"), {0.0, "ManyWithoutAFloor"}}) {
    ParticleCase& many = add(name, 65);
    many.recording = random_recording(1, 10'000, 435);
    many.options.contact.gamma = gamma;
    many.nats *= 10'000 / 36.0;
  }
  // Without a floor, these log odds cost a touch some 1e4 nats, of which float32 keeps 1e-3.
  ParticleCase& unlikely = add("HoweverUnlikely", 2000);
  unlikely.objects = {{random_map(200, 200, 0.5, 1.0, 85), 1.0}};
  unlikely.objects[0].map.log_odds.assign(200 * 200, -1000.0F);
  unlikely.options.contact.gamma = 0.0;
  unlikely.options.augmented = true;
  unlikely.nats = 1e-2;
  // One element, and a map that is sure of being empty but for a square millimetre: of a block of
  // 1,024 particles one or two are likely, and relative to any other the weights would be infinite.
  ParticleCase& dot = add("FewOfWhichAreLikely", 8192);
  dot.objects = {{random_map(261, 261, 0.5, 1.0, 86), 1.0}};
  std::vector<float>& cells = dot.objects[0].map.log_odds;
  cells.assign(261 * 261, -1000.0F);
  for (const std::size_t cell :
       {130 * 261 + 130, 130 * 261 + 131, 131 * 261 + 130, 131 * 261 + 131}) {
    cells[cell] = 1000.0F;
  }
  dot.recording.elements_mm = {{0.0, 0.0}};
  dot.recording.T_robot_sensor = {Pose{}};
  dot.recording.pressure = {10.0};
  dot.options.contact.gamma = 0.0;
  dot.options.region.x_mm = dot.options.region.y_mm = {-25.0, 25.0};
  dot.nats = 1e-3;
  const std::vector<Hypothesis> steep{{random_map(31, 27, 0.5, 12.0, 72), 1.0},
                                      {random_map(61, 61, 0.25, 12.0, 73), 2.0},
                                      {random_map(23, 29, 0.5, 12.0, 74), 1.0}};
  LearnedScene levels = learned_scene(MapLayer::mean_level, 311);
  LearnedScene odds = learned_scene(MapLayer::log_odds, 311);
  for (auto& [name, scene] : {std::pair("TableOfEveryObject", LearnedScene{steep, random_table(3)}),
                              {"TableOfAllObjects", {steep, random_table(1)}},
                              {"LearnedLayerOfLogOdds", odds},
                              {"LearnedLayerOfMeanLevels", levels}}) {
    ParticleCase& of = add(name, 1000);
    of.objects = scene.objects;
    of.options.contact = scene.contact;
  }
  // More particles, and maps of different cells of which neither fills a table, than Vulkan's least
  // tables hold.
  const auto least = [](gpu::Limits& limits) { limits = gpu::least_limits(limits); };
  for (const auto& [name, resampling] : {std::pair("LeastLimitsSystematic", Resampling::systematic),
                                         {"LeastLimitsMultinomial", Resampling::multinomial}}) {
    ParticleCase& of = add(name, 70'000);
    of.options.resampling = resampling;
    of.recording = random_recording(2, 12, 191);
    of.stride = 101;
    of.lower = least;
  }
  ParticleCase& maps = add("LeastLimitsOfLargeMaps", 1000);
  maps.objects = {{random_map(200, 210, 0.1, 4.0, 192), 1.0},
                  {random_map(210, 190, 0.09, 4.0, 193), 1.0}};
  maps.lower = least;
  return cases;
}

}  // namespace palpate
