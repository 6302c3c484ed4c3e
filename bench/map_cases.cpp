#include <algorithm>
#include <cmath>
#include <random>

#include <fmt/format.h>

#include "cases.hpp"
#include "letters.hpp"
#include "reference/reference.hpp"

namespace palpate::bench {

namespace {

constexpr double goal_fine_seconds = 0.2;
constexpr double goal_map_nats = 1e-3;
constexpr double fine_cell_mm = 0.1;

/// A random cell of the map, as a grid of its own.
OccupancyGrid random_cell(const OccupancyGrid& map, std::mt19937_64& random) {
  OccupancyGrid cell;
  cell.cell_mm = map.cell_mm;
  const auto i = static_cast<int>(random() % static_cast<std::uint64_t>(map.nx));
  const auto j = static_cast<int>(random() % static_cast<std::uint64_t>(map.ny));
  cell.origin_mm = map.centre_mm(i, j);
  cell.nx = cell.ny = 1;
  cell.log_odds = {map.at(i, j)};
  return cell;
}

/// `count` touches of the letter A, all over it or within half a millimetre of one spot.
Recording streamed_touches(int count, bool one_spot) {
  std::vector<Pose> poses = random_poses(count, 400);
  if (one_spot) {
    for (Pose& pose : poses) {
      pose.translation_mm *= 0.05;  // of the training grid's +-10.2 mm
    }
  }
  return Simulator(make_shape("A"), SensorModel{}, digitacts_array(), 401).touch(poses, Pose{});
}

}  // namespace

Case fine_map_case(const Inputs& inputs) {
  MapOptions options{.cell_mm = fine_cell_mm};
  options.sensor.prior = *inputs.model.prior;
  MapBuilder builder(inputs.device, options);
  std::vector<std::vector<Touch>> touches;
  for (const Recording& recording : inputs.training) {
    touches.push_back(all_touches(recording));
  }
  std::vector<OccupancyGrid> maps;
  const auto build_all = [&] {
    maps.clear();
    for (std::size_t letter = 0; letter < touches.size(); ++letter) {
      builder.clear();
      builder.add(touches[letter]);
      maps.push_back(builder.build(inputs.training[letter].object));
    }
  };
  const int repeats = inputs.quick ? 1 : 15;
  const double seconds = median_seconds(build_all, repeats);

  std::mt19937_64 random(410);
  ErrorStatistics errors;
  std::size_t cells = 0;
  for (std::size_t letter = 0; letter < maps.size(); ++letter) {
    cells += maps[letter].log_odds.size();
    for (int sample = 0; sample < (inputs.quick ? 20 : 200); ++sample) {
      const OccupancyGrid cell = random_cell(maps[letter], random);
      errors.add(cell.log_odds[0] - reference::log_odds_map(touches[letter], cell,
                                                            options.classifier, options.sensor)[0]);
    }
  }
  return {.name = fmt::format("maps at {} mm", fine_cell_mm),
          .facts = {{"objects", maps.size()},
                    {"touches of each", touches.front().size()},
                    {"cells", cells},
                    {"repeats", repeats}},
          .measurements = {{"all maps", seconds, "s", at_most(goal_fine_seconds)},
                           {"largest error", errors.largest(), "nats", at_most(goal_map_nats)},
                           {"RMS error", errors.rms(), "nats"}}};
}

Case map_stream_case(const Inputs& inputs, bool one_spot) {
  // One batch over and over: its float64 sum in a cell, so many times, is that of the whole stream.
  constexpr int batch = 1000;
  const int batches = inputs.quick ? 10 : 1000;
  const Recording recording = streamed_touches(batch, one_spot);
  const std::vector<Touch> touches = all_touches(recording);
  MapOptions options;
  options.sensor.prior = *inputs.model.prior;
  MapBuilder builder(inputs.device, options);
  builder.add(touches);
  builder.build("warm-up");
  builder.clear();

  restart_peak_memory();
  const std::uint64_t before = resident_bytes();
  OccupancyGrid map;
  const double seconds = seconds_of([&] {
    for (int i = 0; i < batches; ++i) {
      builder.add(touches);
    }
    map = builder.build("A");
  });
  const double growth = static_cast<double>(peak_resident_bytes()) - static_cast<double>(before);

  std::mt19937_64 random(420);
  ErrorStatistics relative;
  const double prior = map.prior_log_odds();
  for (int sample = 0; sample < (inputs.quick ? 20 : 200); ++sample) {
    const OccupancyGrid cell = random_cell(map, random);
    const double of_a_batch =
        reference::log_odds_map(touches, cell, options.classifier, options.sensor)[0] - prior;
    const double expected = prior + batches * of_a_batch;
    relative.add((cell.log_odds[0] - expected) / std::max(std::abs(expected), std::abs(prior)));
  }
  return {.name = one_spot ? "map stream of one spot" : "map stream of a letter",
          .facts = {{"touches", batch * batches},
                    {"touches per batch", batch},
                    {"elements", recording.elements()},
                    {"cell_mm", map.cell_mm},
                    {"cells", map.log_odds.size()}},
          .measurements = {{"per touch", 1e6 * seconds / (batch * batches), "us"},
                           {"peak memory's growth", growth / (1 << 20), "MiB"},
                           {"largest relative error", relative.largest(), "of the log odds"}}};
}

}  // namespace palpate::bench
