#include "cases.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "letters.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "reference/reference.hpp"

namespace palpate::bench {

namespace {

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

/// Median seconds of the program for an unknown, by `palpate recognize`, and for all unknowns, by
/// `palpate batch` and bounds; start and end included.
std::pair<double, double> command_seconds(const Inputs& inputs,
                                          const std::filesystem::path& program) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("palpate-bench-{}", ::getpid());
  const std::shared_ptr<void> removed(nullptr, [&](void*) {
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
  });
  for (const char* name : {"maps", "unknowns"}) {
    std::filesystem::create_directories(folder / name);
  }
  for (const Hypothesis& letter : inputs.letters) {
    write_map(folder / "maps" / (letter.map.label + ".map.h5"), letter.map);
  }
  const auto recording = [&](std::size_t i) {
    return folder / "unknowns" / fmt::format("{:04}.h5", i);
  };
  for (std::size_t i = 0; i < inputs.unknowns.size(); ++i) {
    write_recording(recording(i), inputs.unknowns[i]);
  }

  const auto seconds_of_command = [&](const std::string& arguments) {
    const std::string command =
        fmt::format("'{}' {} --maps '{}' --bins 25x25x16 --x-mm=-10:10 --y-mm=-10:10 >/dev/null",
                    program.string(), arguments, (folder / "maps").string());
    return seconds_of([&] {
      if (std::system(command.c_str()) != 0) {
        throw Error(Fault::system, fmt::format("{}: failed; run it by hand", command));
      }
    });
  };
  std::vector<double> each;
  for (std::size_t i = 0; i < (inputs.quick ? 3 : 10); ++i) {
    each.push_back(seconds_of_command(fmt::format("recognize '{}' --filter histogram --device '{}'",
                                                  recording(i).string(), inputs.device.name())));
  }
  std::vector<double> batch;
  for (int run = 0; run < (inputs.quick ? 1 : 5); ++run) {
    batch.push_back(seconds_of_command(fmt::format(
        "batch '{}/unknowns' -o '{}/{}' --filter bounded", folder.string(), folder.string(), run)));
  }
  return {median(each), median(batch)};
}

}  // namespace

Case fine_map_case(const Inputs& inputs) {
  constexpr double cell_mm = 0.1;
  MapOptions options{.cell_mm = cell_mm};
  options.sensor.prior = *inputs.model.prior;
  MapBuilder builder(inputs.device, options);
  std::vector<std::vector<Touch>> touches;
  for (const Recording& recording : inputs.training) {
    touches.push_back(all_touches(recording));
  }
  std::vector<OccupancyGrid> maps(touches.size());
  const int repeats = inputs.quick ? 1 : 15;
  const auto build_all = [&] {
    for (std::size_t letter = 0; letter < touches.size(); ++letter) {
      builder.clear();
      builder.add(touches[letter]);
      maps[letter] = builder.build(inputs.training[letter].object);
    }
  };
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
  return {.name = fmt::format("maps at {} mm", cell_mm),
          .facts = {{"objects", maps.size()},
                    {"touches of each", touches.front().size()},
                    {"cells", cells},
                    {"repeats", repeats}},
          .measurements = {{"all maps", seconds, "s", at_most(0.2)},
                           {"largest error", errors.largest, "nats", at_most(1e-3)},
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
                           {"largest relative error", relative.largest, "of the log odds"}}};
}

Case many_unknowns_case(const Inputs& inputs) {
  const PoseLattice lattice = lattice_of(25, 25, 16);
  const int large_thetas = inputs.quick ? 160 : 1600;
  const auto bins =
      static_cast<double>(lattice.bins()) * static_cast<double>(inputs.letters.size());
  const auto per_bin = static_cast<double>(inputs.unknowns.front().pressure.size());
  PoseHistogram histogram = letter_histogram(inputs, lattice);
  const auto recognise = [](PoseHistogram& with, const Recording& unknown) {
    with.reset();
    with.update(all_touches(unknown));
    return with.estimate();
  };
  median_seconds([&] { recognise(histogram, inputs.unknowns.front()); }, 1);  // warms up

  std::vector<Estimate> estimates;
  const double seconds = seconds_of([&] {
    for (const Recording& unknown : inputs.unknowns) {
      estimates.push_back(recognise(histogram, unknown));
    }
  });
  const auto unknowns = static_cast<double>(inputs.unknowns.size());
  const double ns = 1e9 * seconds / (unknowns * bins * per_bin);

  PoseHistogram large = letter_histogram(inputs, lattice_of(25, 25, large_thetas));
  const double large_seconds =
      median_seconds([&] { recognise(large, inputs.unknowns.front()); }, inputs.quick ? 1 : 3);
  const double large_ns =
      1e9 * large_seconds / (bins * large_thetas / lattice.theta_rad.count * per_bin);

  int right = 0;
  for (std::size_t i = 0; i < inputs.unknowns.size(); ++i) {
    const std::string& best = inputs.letters[estimates[i].mode.object].map.label;
    right += best == inputs.unknowns[i].truth->object ? 1 : 0;
  }
  int different = 0;
  const std::size_t last = inputs.unknowns.size() - 1;
  for (const std::size_t i : {std::size_t{0}, last / 2, last}) {
    PoseHistogram own = letter_histogram(inputs, lattice);
    bool alike = same(recognise(own, inputs.unknowns[i]), estimates[i]);
    recognise(histogram, inputs.unknowns[i]);
    for (int object = 0; object < static_cast<int>(inputs.letters.size()); ++object) {
      alike = alike && own.log_likelihood(object) == histogram.log_likelihood(object);
    }
    different += alike ? 0 : 1;
  }

  Case result{.name = "many unknowns",
              .facts = {{"unknowns", inputs.unknowns.size()},
                        {"touches of each", inputs.unknowns.front().size()},
                        {"objects", inputs.letters.size()},
                        {"bins", "25x25x16"},
                        {"large case's bins", fmt::format("25x25x{}", large_thetas)},
                        {"path", histogram.paths()}},
              .measurements = {{"rate", unknowns / seconds, "unknowns per s"},
                               {"per bin, element and touch", ns, "ns"},
                               {"one large case, per bin, element and touch", large_ns, "ns"},
                               {"lost against the large case", 100.0 * (ns / large_ns - 1.0), "%",
                                at_most(10.0)},
                               {"of 3, other bits than one by one", static_cast<double>(different),
                                "unknowns", at_most(0)},
                               {"letter of the mode is right", 100.0 * right / unknowns, "%"}}};
  const std::filesystem::path program =
      std::filesystem::read_symlink("/proc/self/exe").replace_filename("palpate");
  if (!std::filesystem::exists(program)) {
    result.facts["commands"] = "not measured: no palpate beside this program";
    return result;
  }
  const auto [each, batch] = command_seconds(inputs, program);
  result.add(
      {{"a process per unknown", 1.0 / each, "unknowns per s"},
       {"rate over a process per unknown", each * unknowns / seconds, "times", at_least(4.0)},
       {"palpate batch by bounds", unknowns / batch, "unknowns per s", at_least(1000.0)}});
  return result;
}

Json search_by_bounds(const std::vector<Hypothesis>& letters, bool quick) {
  // An A, whose first touch meets an edge of the letter, on bins all over the letters.
  constexpr std::uint64_t seed = 1'405'000'018;
  constexpr double extent_mm = 15.0;
  const Recording unknown = unknown_recordings(1, touches_per_unknown, seed).front();
  PoseLattice lattice = quick ? lattice_of(20, 20, 16) : lattice_of(200, 200, 250);
  lattice.x_mm = {-extent_mm, extent_mm, lattice.x_mm.count};
  lattice.y_mm = lattice.x_mm;
  // As --pivot-mm auto: x and y are where the first touch lies on the letter.
  lattice.pivot_mm = unknown.T_robot_sensor.front().translation_mm;
  const glm::dvec2 place_mm = unknown.truth->T_object_robot * lattice.pivot_mm;
  BoundedPosterior posterior(letters, {.lattice = lattice});
  Json stages = Json::array();
  std::size_t done = 0;
  for (const std::size_t touches : {std::size_t{1}, std::size_t{3}, std::size_t{9}}) {
    posterior.update(unknown.touches(done, touches));
    done = touches;
    std::map<std::tuple<int, int, int, int, int>, int> thetas;  // by level and place
    for (const PoseBlock& b : posterior.refined_blocks()) {
      if (b.object == 0) {
        ++thetas[{b.level, b.x_first, b.x_count, b.y_first, b.y_count}];
      }
    }
    Json blocks = Json::array();
    for (const auto& [at, count] : thetas) {
      const auto& [level, x, nx, y, ny] = at;
      blocks.push_back({level, x, nx, y, ny, count});
    }
    stages.push_back({{"touches", touches},
                      {"bins_evaluated", posterior.estimate().certificate->bins_evaluated},
                      {"blocks", blocks}});
  }
  return {{"bins", {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count}},
          {"bins_in_all", lattice.bins() * static_cast<std::int64_t>(letters.size())},
          {"extent_mm", extent_mm},
          {"place_mm", {place_mm.x, place_mm.y}},
          {"stages", stages}};
}

}  // namespace palpate::bench
