#include "palpate/virtual_sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "model/number_text.hpp"
#include "model/refuse.hpp"
#include "model/stream_time.hpp"
#include "palpate/files.hpp"
#include "palpate/simulation.hpp"
#include "palpate/touch.hpp"
#include "streaming/simulated_sensor.hpp"

namespace palpate {

namespace {

/// Plays a recording of frames: see open_virtual_sensor().
class ReplayedSensor : public Sensor {
 public:
  /// @throws Error where the file is no recording of frames with times
  ReplayedSensor(const std::string& path, std::optional<double> speed)
      : recording_(read_recording(path)), pace_(speed) {
    const Recording& r = recording_;
    if (r.rows != "frames") {
      refuse(path,
             "attribute 'rows' = 'touches' means single readings; give a stream of frames, or "
             "recognise the touches: palpate recognize");
    }
    if (r.time_s.empty()) {
      refuse(path, "dataset 'time' is missing; a replay needs the times of the frames");
    }
    const std::size_t e = r.elements();
    if (r.elements_mm.size() != e) {
      refuse(path,
             "dataset 'elements' changes from frame to frame; record each array to its own file");
    }
    description_ = {.name = r.sensor,
                    .serial = r.serial,
                    .pressure_unit = r.pressure_unit,
                    .elements_mm = r.elements_mm,
                    .valid = std::vector<std::uint8_t>(r.valid.empty() ? 0 : e, 0),
                    .baseline = r.baseline,
                    .object = r.object,
                    .truth = r.truth,
                    .findings = r.findings};
    // An element that is valid in no frame is dead.
    for (std::size_t k = 0; k < r.valid.size(); ++k) {
      description_.valid[k % e] |= r.valid[k];
    }
    StreamTime time;
    for (const double time_s : r.time_s) {
      time.advance(time_s);
    }
    if (time.elapsed_s() > 0.0) {
      description_.rate_hz = static_cast<double>(r.size() - 1) / time.elapsed_s();
    }
  }

  const SensorDescription& description() const override { return description_; }

  void start() override {
    at_ = 0;
    counters_ = {};
    pace_.start(recording_.time_s.front());
  }

  std::optional<Frame> next(std::chrono::milliseconds timeout) override {
    if (ended() || !pace_.wait(recording_.time_s[at_], timeout)) {
      return {};
    }
    const Recording& r = recording_;
    const std::size_t i = at_++;
    const Touch touch = r.touch(i);
    std::vector<double> values(touch.pressure.begin(), touch.pressure.end());
    if (r.valid.size() != r.elements()) {
      for (std::size_t k = 0; k < touch.valid.size(); ++k) {
        if (touch.valid[k] == 0) {
          values[k] = std::numeric_limits<double>::quiet_NaN();  // Unknown in this frame
        }
      }
    }
    Frame frame{.host_time_s = r.time_s[i],
                .values = std::move(values),
                .lost_before = r.lost_before.empty() ? 0 : r.lost_before[i]};
    if (!r.device_time_s.empty() && !std::isnan(r.device_time_s[i])) {
      frame.device_time_s = r.device_time_s[i];
    }
    if (!std::isnan(touch.T_robot_sensor.theta_rad)) {
      frame.T_robot_sensor = touch.T_robot_sensor;
    }
    ++counters_.frames;
    count_lost(counters_.lost, frame.lost_before);
    return frame;
  }

  bool ended() const override { return at_ == recording_.size(); }
  void stop() override {}
  SensorCounters counters() const override { return counters_; }

 private:
  Recording recording_;
  SensorDescription description_;
  Pace pace_;
  std::size_t at_ = 0;  ///< index of the next frame
  SensorCounters counters_;
};

constexpr std::string_view replay = "replay:";
constexpr std::string_view simulate = "simulate:";

/// What a name such as "simulate:A,rate=1000,object=1:2:30" says.
class SourceName {
 public:
  explicit SourceName(const std::string& name) : name_(name) {
    const bool replays = name.starts_with(replay);
    const auto keys = replays ? std::vector<std::string>{"speed"}
                              : std::vector<std::string>{"rate",  "array",  "seed", "touches",
                                                         "noise", "object", "speed"};
    what_ = name.substr(replays ? replay.size() : simulate.size());
    // A path may hold commas and equals signs, so that only a known key ends it.
    for (auto comma = what_.rfind(','); comma != what_.npos; comma = what_.rfind(',')) {
      const std::string option = what_.substr(comma + 1);
      const std::string key = option.substr(0, option.find('='));
      const bool is_known = std::ranges::find(keys, key) != keys.end();
      if (!is_known && replays) {
        break;
      }
      if (!is_known) {
        refuse(key, fmt::format("is no option; the options are {}", fmt::join(keys, ", ")));
      }
      if (key.size() == option.size()) {
        refuse(key, "has no value; write key=value");
      }
      if (!options_.emplace(key, option.substr(key.size() + 1)).second) {
        refuse(key, "is given twice; leave one out");
      }
      what_.resize(comma);
    }
    if (what_.empty()) {
      refuse(name.substr(0, name.find(':') + 1),
             "names nothing; write replay:FILE or simulate:SHAPE");
    }
  }

  /// The file or the shape.
  const std::string& what() const { return what_; }

  template <typename Number>
  std::optional<Number> number(const char* key, Number least, Number upper_bound) const {
    const auto found = options_.find(key);
    return found == options_.end() ? std::nullopt
                                   : std::optional(parse(key, found->second, least, upper_bound));
  }

  std::optional<double> speed() const {
    const auto found = options_.find("speed");
    const bool is_max = found != options_.end() && found->second == "max";
    return is_max ? std::nullopt : std::optional(number("speed", 1e-3, 1e6).value_or(1.0));
  }

  std::optional<Pose> object_pose(std::uint64_t seed) const {
    if (const auto found = options_.find("object");
        found == options_.end() || found->second == "random") {
      return found == options_.end() ? std::nullopt : std::optional(random_object_pose(seed));
    }
    const auto [x, y, deg] = three("object", "must be random, or X:Y:DEG in mm and degrees");
    constexpr double far = 1e6;  // in mm and in degrees
    return Pose{{parse("object", x, -far, far), parse("object", y, -far, far)},
                parse("object", deg, -far, far) * std::numbers::pi / 180.0};
  }

  std::vector<glm::dvec2> array() const {
    if (!options_.contains("array")) {
      return {};
    }
    const auto [columns, rows, pitch_mm] =
        three("array", "must be COLUMNS:ROWS:PITCH, the pitch in mm");
    return grid_array(parse("array", columns, 1, 64), parse("array", rows, 1, 64),
                      parse("array", pitch_mm, 0.01, 100.0));
  }

 private:
  [[noreturn]] void refuse(std::string_view key, std::string_view message) const {
    palpate::refuse("sensor " + name_, "{} {}", key, message);
  }

  /// The parts of A:B:C.
  std::array<std::string_view, 3> three(const char* key, std::string_view remedy) const {
    const std::vector<std::string_view> parts = split_text(options_.at(key), ':');
    if (parts.size() != 3) {
      refuse(key, remedy);
    }
    return {parts[0], parts[1], parts[2]};
  }

  template <typename Number>
  Number parse(std::string_view key, std::string_view text, Number least,
               Number upper_bound) const {
    const auto value = detail::all_of<Number>(text);
    if (!value || !(*value >= least && *value <= upper_bound)) {  // NaN too
      refuse(key, fmt::format("= {}: give a number from {} to {}", text, least, upper_bound));
    }
    return *value;
  }

  std::string name_;
  std::string what_;
  std::map<std::string, std::string> options_;
};

SimulatedSensorOptions options_of(const SourceName& source) {
  SimulatedSensorOptions options;
  options.rate_hz = source.number("rate", 1.0, 1e5).value_or(options.rate_hz);
  options.seed = source.number<std::uint64_t>("seed", 0, UINT64_MAX).value_or(options.seed);
  options.touches = source.number<std::uint64_t>("touches", 1, 1'000'000'000);
  options.noise_kpa = source.number("noise", 0.0, 1e3).value_or(options.noise_kpa);
  options.T_object_robot = source.object_pose(options.seed);
  options.elements_mm = source.array();
  options.speed = source.speed();
  return options;
}

}  // namespace

bool is_virtual_sensor(std::string_view name) {
  return name.starts_with(replay) || name.starts_with(simulate);
}

std::optional<std::filesystem::path> virtual_sensor_file(const std::string& name) {
  if (name.starts_with(replay)) {
    return SourceName(name).what();
  }
  const std::string shape = SourceName(name).what();
  return built_in_shape(shape) ? std::nullopt : std::optional<std::filesystem::path>(shape);
}

bool is_endless_flood(const std::string& name) {
  if (!name.starts_with(simulate)) {
    return false;
  }
  const SimulatedSensorOptions options = options_of(SourceName(name));
  return !options.touches && !options.speed;
}

std::unique_ptr<Sensor> open_virtual_sensor(const std::string& name) {
  if (!is_virtual_sensor(name)) {
    refuse("sensor " + name, "write replay:FILE or simulate:SHAPE");
  }
  const SourceName source(name);
  if (name.starts_with(replay)) {
    return std::make_unique<ReplayedSensor>(source.what(), source.speed());
  }
  return make_simulated_sensor(source.what(), options_of(source));
}

}  // namespace palpate
