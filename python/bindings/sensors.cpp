#include <chrono>
#include <cmath>
#include <functional>
#include <memory>

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "palpate/driver.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/sensor.hpp"
#include "palpate/touch_detector.hpp"
#include "palpate/virtual_sensor.hpp"
#include "shared.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;
using namespace std::chrono_literals;

namespace {

using SharedSensor = Shared<std::unique_ptr<Sensor>>;

/// What `work`, a function or method of the sensor, returns.
template <typename F>
auto called(F work) {
  return [work](const SharedSensor& self) {
    return self.use([&](std::unique_ptr<Sensor>& sensor) { return std::invoke(work, *sensor); });
  };
}

SensorDescription description_of(const SharedSensor& self) {
  return called(&Sensor::description)(self);
}

/// The next frame; none where the stream has ended, or after the timeout. Ctrl-C ends the wait.
std::optional<Frame> next(const SharedSensor& self, std::optional<double> timeout_s) {
  using Clock = std::chrono::steady_clock;
  constexpr double longest_s = 1e8;  // that the clock can count
  if (timeout_s && std::isnan(*timeout_s)) {
    throw nb::value_error("timeout_s: is not a number; give seconds, or None to wait for a frame");
  }
  const auto end = Clock::now() + std::chrono::duration<double>(
                                      std::clamp(timeout_s.value_or(longest_s), 0.0, longest_s));
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    auto [frame, over] = called([wait = std::clamp(left, 0ms, 50ms)](Sensor& sensor) {
      auto taken = sensor.next(wait);
      const bool is_last = !taken && sensor.ended();
      return std::pair(std::move(taken), is_last);
    })(self);
    if (frame || over || left <= 0ms) {
      return std::move(frame);
    }
    if (PyErr_CheckSignals() != 0) {
      throw nb::python_error();
    }
  }
}

SharedSensor open_sensor(const PathLike& board_or_file,
                         const std::optional<PathLike>& pose_source) {
  const auto poses = pose_source ? std::optional(pose_source->text()) : std::nullopt;
  const std::string name = board_or_file.text();
  return {"sensor", {}, run([&] {
            std::unique_ptr<Sensor> opened =
                is_virtual_sensor(name) ? open_virtual_sensor(name) : open_board(name);
            return poses ? std::make_unique<PosedSensor>(std::move(opened), *poses)
                         : std::move(opened);
          })};
}

// Properties of the class Sensor.

template <typename Value>
auto described(Value SensorDescription::*field) {
  return [field](const SharedSensor& self) { return description_of(self).*field; };
}

/// [e], or None where the sensor has no such values.
template <typename ArrayType, typename Value>
auto described_array(std::vector<Value> SensorDescription::*field) {
  return [field](const SharedSensor& self) -> std::optional<ArrayType> {
    std::vector<Value> values = description_of(self).*field;
    return values.empty() ? std::nullopt
                          : std::optional(nb::borrow<ArrayType>(owned(std::move(values))));
  };
}

void bind_frame(nb::module_& module) {
  nb::class_<Frame>(module, "Frame", "One reading of a whole array, as a sensor delivers it.")
      .def(
          "__init__",
          [](Frame* self, double host_time_s, const ArrayLike& values,
             const std::optional<ArrayLike>& T_robot_sensor) {
            Frame frame{.host_time_s = host_time_s,
                        .values = ArrayReader().known(values, "values", {"e"}).copied()};
            if (T_robot_sensor) {
              frame.T_robot_sensor = pose_of(*T_robot_sensor, "T_robot_sensor");
            }
            new (self) Frame(std::move(frame));
          },
          "host_time_s"_a, "values"_a, "T_robot_sensor"_a = nb::none(),
          "host_time_s since the Unix epoch; values [e] in the pressure unit, NaN: unknown;\n"
          "T_robot_sensor [3] (x_mm, y_mm, theta_rad), where it is known.")
      .def_ro("host_time_s", &Frame::host_time_s, "Time of arrival, since the Unix epoch.")
      .def_ro("device_time_s", &Frame::device_time_s, "By the sensor's own clock, or None.")
      .def_ro("lost_before", &Frame::lost_before, "Frames lost since the last frame.")
      .def_prop_ro("values", view_of(&Frame::values),
                   "[e] in the sensor's pressure unit; NaN: unknown.")
      .def_prop_ro("T_robot_sensor", array_of(&Frame::T_robot_sensor),
                   "[3] (x_mm, y_mm, theta_rad), or None.")
      .def("__repr__", &repr_of);
}

void bind_sensor(nb::module_& module) {
  nb::class_<SharedSensor>(
      module, "Sensor",
      "A stream of frames from a board, a file or a simulation: a context manager that starts and\n"
      "stops it, and an iterator over its frames, which ends with the stream.")
      .def("start", called(&Sensor::start),
           "Starts the stream. Raises Error where the hardware refuses.")
      .def("stop", called(&Sensor::stop), "Stops the stream.")
      .def(
          "__enter__",
          [](nb::handle_t<SharedSensor> self) {
            called (&Sensor::start)(nb::cast<SharedSensor&>(self));
            return self;
          },
          nb::sig("def __enter__(self) -> Sensor"))
      .def(
          "__exit__",
          [](SharedSensor& self, nb::handle, nb::handle, nb::handle) {
            called (&Sensor::stop)(self);
          },
          "type"_a.none(), "value"_a.none(), "traceback"_a.none(),
          nb::sig("def __exit__(self, type: object, value: object, traceback: object) -> None"))
      .def(
          "__iter__", [](nb::handle_t<SharedSensor> self) { return self; },
          nb::sig("def __iter__(self) -> Sensor"))
      .def("__next__",
           [](SharedSensor& self) {
             auto frame = next(self, {});
             if (!frame) {
               throw nb::stop_iteration();
             }
             return *std::move(frame);
           })
      .def("next", &next, "timeout_s"_a = nb::none(),
           "The next frame; None where none comes within timeout_s, and after the stream's end.\n"
           "Ctrl-C ends the wait.")
      .def_prop_ro("ended", called(&Sensor::ended),
                   "True after the last frame of a stream that ends.")
      .def_prop_ro("gone", called(&Sensor::gone), "True while the board is unplugged.")
      .def_prop_ro("name", described(&SensorDescription::name), "For people, such as \"TakkTile\".")
      .def_prop_ro("pressure_unit", described(&SensorDescription::pressure_unit),
                   "\"kPa\" or \"raw\".")
      .def_prop_ro("rate_hz", described(&SensorDescription::rate_hz),
                   "Frames per second, 0 if unknown.")
      .def_prop_ro("object", described(&SensorDescription::object),
                   "Label of the object, where a replay or a simulation knows it, or \"\".")
      .def_prop_ro(
          "truth", described(&SensorDescription::truth),
          "The true identity and pose, where a replay or a simulation knows them, or None.")
      .def_prop_ro(
          "elements_mm",
          [](const SharedSensor& self) { return to_array(description_of(self).elements_mm); },
          "[e, 2] in the sensor frame.")
      .def_prop_ro("valid", described_array<ByteArray>(&SensorDescription::valid),
                   "[e], 0 for a dead element; None: all are alive.")
      .def_prop_ro("baseline", described_array<FloatArray>(&SensorDescription::baseline),
                   "[e] untouched readings, or None.")
      .def_prop_ro("lost", called([](const Sensor& sensor) { return sensor.counters().lost; }),
                   "Frames lost since start().")
      .def("__repr__", [](SharedSensor& self) {
        const SensorDescription sensor = description_of(self);
        return fmt::format("Sensor('{}', {} elements in {})", sensor.name,
                           sensor.elements_mm.size(), sensor.pressure_unit);
      });
  module.def(
      "open_sensor", &open_sensor, "name"_a, "poses"_a = nb::none(),
      "Opens a sensor: a board such as \"takktile\" or the path of a board's YAML profile,\n"
      "\"replay:FILE\", or \"simulate:SHAPE\", with options as in `--sensor` of `palpate live`. "
      "poses: a\n"
      "file or FIFO of the robot's poses, lines of JSON. Raises Error naming what is missing.");
}

void bind_detector(nb::module_& module) {
  nb::class_<DetectedTouch>(module, "DetectedTouch",
                            "One touch of a stream: robust means over its longest steady phase.")
      .def_ro("begin_s", &DetectedTouch::begin_s,
              "Time of the first frame averaged, since the Unix epoch.")
      .def_ro("end_s", &DetectedTouch::end_s,
              "Time of the last frame averaged, since the Unix epoch.")
      .def_ro("frames", &DetectedTouch::frames, "Number of frames averaged.")
      .def_prop_ro("pressure", view_of(&DetectedTouch::pressure), "[e], above the baseline.")
      .def_prop_ro("valid", view_of(&DetectedTouch::valid),
                   "[e], 0 for an element that is dead or was hardly known; empty: all are alive.")
      .def_prop_ro("T_robot_sensor", array_of(&DetectedTouch::T_robot_sensor),
                   "[3] (x_mm, y_mm, theta_rad), or None.")
      .def("__repr__", &repr_of);

  const TouchDetectorOptions usual;
  nb::class_<TouchDetector>(module, "TouchDetector",
                            "Finds touches in a stream of frames by onset, steady phase and "
                            "release.\nPressures are in the sensor's unit, above the baseline.")
      .def(
          "__init__",
          [](TouchDetector* self, double onset, double release, double min_steady_s, double steady,
             double smooth_s, double drift_s, const std::optional<ArrayLike>& baseline,
             const std::optional<ArrayLike>& valid) {
            ArrayReader reader;
            const Floats zeros = baseline ? reader.floats(*baseline, "baseline", {"e"}) : Floats();
            const Bytes alive = valid ? reader.flags(*valid, "valid", {"e"}) : Bytes();
            new (self) TouchDetector({.onset = onset,
                                      .release = release,
                                      .steady = steady,
                                      .min_steady_s = min_steady_s,
                                      .smooth_s = smooth_s,
                                      .drift_s = drift_s},
                                     zeros.copied(), alive.copied());
          },
          nb::kw_only(), "onset"_a = usual.onset, "release"_a = usual.release,
          "min_steady_s"_a = usual.min_steady_s, "steady"_a = usual.steady,
          "smooth_s"_a = usual.smooth_s, "drift_s"_a = usual.drift_s, "baseline"_a = nb::none(),
          "valid"_a = nb::none(),
          "A touch begins where the largest pressure exceeds onset and ends where it falls below\n"
          "release. baseline [e]: what the untouched array reads; valid [e], False for a dead\n"
          "element. Raises Error on options out of range.")
      .def("add", &TouchDetector::add, "frame"_a,
           "Takes a frame and returns the touch that ends with it, if any.")
      .def("finish", &TouchDetector::finish,
           "Ends the stream: returns the touch under way, if it was steady long enough.")
      .def_prop_ro("touching", &TouchDetector::touching, "True between onset and release.");
  module.def(
      "baseline_of",
      [](const std::vector<Frame>& frames, SharedSensor& sensor, std::optional<double> onset) {
        return owned(baseline_of(frames, description_of(sensor), onset));
      },
      "frames"_a, "sensor"_a, "onset"_a = nb::none(),
      "Takes a tare: what the untouched array reads, [e], as medians over the frames. With onset,\n"
      "raises Error where the array was touched meanwhile.");
}

}  // namespace

void bind_sensors(nb::module_& module) {
  bind_frame(module);
  bind_sensor(module);
  bind_detector(module);
}

}  // namespace palpate::python
