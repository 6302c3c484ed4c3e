#include "cli/commands.hpp"

#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/options.hpp"
#include "model/number_text.hpp"
#include "options/option.hpp"
#include "palpate/files.hpp"
#include "palpate/simulation.hpp"

namespace palpate::cli {

namespace {

struct SimulateArguments {
  std::string shape;
  std::string output;
  std::uint64_t seed = 1;
  std::string poses = "grid";
  SensorModel sensor;
  std::string object_pose;
  std::optional<int> touches;
};

/// The poses T_object_sensor that --poses asks for, "grid" or "random:N".
std::vector<Pose> sensor_poses(const std::string& text, std::uint64_t seed) {
  if (text == "grid") {
    return training_grid();
  }
  constexpr std::string_view random = "random:";
  constexpr std::int64_t most_poses = 999'999'999;
  const auto count =
      text.starts_with(random) ? whole_number_of(text.substr(random.size())) : std::nullopt;
  if (count && *count > 0 && *count <= most_poses) {
    return random_poses(static_cast<int>(*count), seed);
  }
  refuse_flag("--poses", text, "give grid, or random:N with N above 0");
}

/// Draws n poses without replacement, in random order. A seed gives the same poses on every system.
std::vector<Pose> draw(std::vector<Pose> poses, std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (std::size_t i = 0; i < n; ++i) {
    // std::uniform_int_distribution differs between standard libraries; the bias of % is 1e-17.
    std::swap(poses[i], poses[i + random() % (poses.size() - i)]);
  }
  poses.resize(n);
  return poses;
}

void simulate(const SimulateArguments& options) {
  CommandFiles()
      .reads("SHAPE", built_in_shape(options.shape) ? "" : options.shape)
      .writes("-o", options.output)
      .prepare();
  const Shape shape = make_shape(options.shape);
  const bool unknown = !options.object_pose.empty();
  Pose T_object_robot;
  if (unknown) {
    T_object_robot = options.object_pose == "random"
                         ? random_object_pose(options.seed)
                         : parse_pose("object-pose", options.object_pose);
  }

  std::vector<Pose> poses = sensor_poses(options.poses, options.seed);
  const std::size_t all = poses.size();
  const auto wanted = static_cast<std::size_t>(options.touches.value_or(static_cast<int>(all)));
  if (options.touches && (*options.touches < 1 || wanted > all)) {
    refuse_flag("--touches", *options.touches, "--poses {} has {} poses; give 1 to {}",
                options.poses, all, all);
  }
  if (unknown || options.touches) {
    poses = draw(std::move(poses), wanted, options.seed);
  }
  for (Pose& pose : poses) {
    pose = inverse(T_object_robot) * pose;  // T_robot_sensor from T_object_sensor
  }

  Simulator simulator(shape, options.sensor, digitacts_array(), options.seed);
  Recording recording = simulator.touch(poses, T_object_robot);
  if (unknown) {
    recording.object.clear();
    recording.truth = {.object = shape.label, .T_object_robot = T_object_robot};
  }
  write_recording(options.output, recording);
  fmt::print("{}: {} touches of {}", options.output, recording.size(), shape.label);
  if (unknown) {
    const Pose T_robot_object = inverse(T_object_robot);
    fmt::print(" at x {:.2f} mm, y {:.2f} mm, theta {:.1f} deg in the robot frame",
               T_robot_object.translation_mm.x, T_robot_object.translation_mm.y,
               degrees(wrap_angle(T_robot_object.theta_rad)));
  }
  fmt::print("\n");
}

}  // namespace

void add_simulate(CLI::App& app) {
  const auto [command, options] = add_command<SimulateArguments>(
      app, "simulate", "Simulate touches of a shape with a DigiTacts array and write a recording",
      simulate);
  add_required(*command, "SHAPE", options->shape,
               "A to Z, 0 to 9, ring, bar, or a polygon file with lines 'x y' in mm");
  add_required(*command, "-o,--output", options->output, "Recording to write (HDF5)");
  add_with_default(*command, "--seed", options->seed, "Seed of noise, random poses and order")
      ->check(require_whole_number);
  add_with_default(*command, "--poses", options->poses,
                   "grid (4 x 4 positions 6.8 mm apart, 12 angles at each) or random:N");
  add_with_default(*command, "--psf-mm", options->sensor.psf_mm,
                   "Point spread (standard deviation), mm");
  add_with_default(*command, "--noise-kpa", options->sensor.noise_kpa,
                   "Noise (standard deviation), kPa");
  command->add_option("--object-pose", options->object_pose,
                      "Pose T_object_robot of an unknown object, X,Y,DEG in mm and degrees, or "
                      "random; the file stores it as the truth");
  command
      ->add_option("--touches", options->touches,
                   "Use N of the poses, drawn at random without replacement [default: all]")
      ->check(require_whole_number);
}

}  // namespace palpate::cli
