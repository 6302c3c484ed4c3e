#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cases.hpp"
#include "letters.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate::bench {

namespace {

constexpr double goal_lost_percent = 10.0;
constexpr double goal_rate_over_processes = 4.0;
constexpr double goal_batch_rate = 1000.0;

/// The program `palpate` beside this one, with the letters' maps and the unknowns' recordings in a
/// folder.
class ProgramWithFiles {
 public:
  ProgramWithFiles(const Inputs& inputs, std::filesystem::path program)
      : program_(std::move(program)), device_name_(inputs.device_name) {
    std::filesystem::create_directories(maps_);
    for (const Hypothesis& letter : inputs.letters) {
      write_map(maps_ / (letter.map.label + ".map.h5"), letter.map);
    }
    std::filesystem::create_directories(unknowns_);
    for (const Recording& unknown : inputs.unknowns) {
      recordings_.push_back(unknowns_ / fmt::format("{:04}.h5", recordings_.size()));
      write_recording(recordings_.back(), unknown);
    }
  }
  ~ProgramWithFiles() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  ProgramWithFiles(const ProgramWithFiles&) = delete;
  ProgramWithFiles& operator=(const ProgramWithFiles&) = delete;

  /// Median seconds that `palpate recognize` takes for an unknown, start and end included.
  double seconds_per_process(std::size_t processes) const {
    std::vector<double> seconds;
    for (std::size_t i = 0; i < processes; ++i) {
      seconds.push_back(seconds_of(fmt::format("recognize '{}'", recordings_[i].string())));
    }
    return median(seconds);
  }

  /// Median seconds that `palpate batch` takes for all unknowns by bounds, start and end included.
  double batch_seconds(int runs) const {
    const std::filesystem::path results = folder_ / "results";
    std::vector<double> seconds;
    for (int run = 0; run < runs; ++run) {
      std::filesystem::remove_all(results);
      seconds.push_back(seconds_of(fmt::format("batch '{}' -o '{}' --filter bounded",
                                               unknowns_.string(), results.string())));
    }
    return median(seconds);
  }

 private:
  /// Runs a command of the program to its end, in silence.
  double seconds_of(const std::string& arguments) const {
    std::string command =
        fmt::format("'{}' {} --maps '{}' --bins 25x25x16 --x-mm=-10:10 --y-mm=-10:10 >/dev/null",
                    program_.string(), arguments, maps_.string());
    if (!device_name_.empty()) {
      command += fmt::format(" --device '{}'", device_name_);
    }
    return bench::seconds_of([&] {
      if (std::system(command.c_str()) != 0) {
        throw Error(Fault::system, fmt::format("{}: failed; run it by hand", command));
      }
    });
  }

  std::filesystem::path program_;
  std::string device_name_;
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / fmt::format("palpate-bench-{}", ::getpid());
  std::filesystem::path maps_ = folder_ / "maps";
  std::filesystem::path unknowns_ = folder_ / "unknowns";
  std::vector<std::filesystem::path> recordings_;
};

}  // namespace

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

  int different = 0;
  int right = 0;
  for (std::size_t i = 0; i < inputs.unknowns.size(); ++i) {
    const std::string& best = inputs.letters[estimates[i].mode.object].map.label;
    right += best == inputs.unknowns[i].truth->object ? 1 : 0;
  }
  const std::size_t last = inputs.unknowns.size() - 1;
  for (const std::size_t i : {std::size_t{0}, last / 2, last}) {
    PoseHistogram alone = letter_histogram(inputs, lattice);
    bool alike = same(recognise(alone, inputs.unknowns[i]), estimates[i]);
    recognise(histogram, inputs.unknowns[i]);
    for (int object = 0; object < static_cast<int>(inputs.letters.size()); ++object) {
      alike = alike && alone.log_likelihood(object) == histogram.log_likelihood(object);
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
                                at_most(goal_lost_percent)},
                               {"of 3, other bits than one by one", static_cast<double>(different),
                                "unknowns", at_most(0)},
                               {"letter of the mode is right", 100.0 * right / unknowns, "%"}}};
  const std::filesystem::path program =
      std::filesystem::read_symlink("/proc/self/exe").replace_filename("palpate");
  if (!std::filesystem::exists(program)) {
    result.facts["commands"] = "not measured: no palpate beside this program";
    return result;
  }
  const ProgramWithFiles palpate(inputs, program);
  const double alone = palpate.seconds_per_process(inputs.quick ? 3 : 10);
  const double batch = palpate.batch_seconds(inputs.quick ? 1 : 5);
  result.measurements.insert(
      result.measurements.end(),
      {{"a process per unknown", 1.0 / alone, "unknowns per s"},
       {"rate over a process per unknown", alone * unknowns / seconds, "times",
        at_least(goal_rate_over_processes)},
       {"palpate batch by bounds", unknowns / batch, "unknowns per s", at_least(goal_batch_rate)}});
  return result;
}

}  // namespace palpate::bench
