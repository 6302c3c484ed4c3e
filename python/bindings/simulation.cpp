#include <algorithm>

#include <nanobind/stl/optional.h>

#include "bindings.hpp"
#include "call.hpp"
#include "model/random.hpp"
#include "palpate/simulation.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

RecordingObject simulate(const PathLike& letter_or_file,
                         const std::optional<ArrayLike>& T_object_sensor,
                         const std::optional<ArrayLike>& T_object_robot,
                         const std::optional<ArrayLike>& elements_mm, std::uint64_t seed,
                         const SensorModel& model) {
  const std::vector<Pose> poses =
      T_object_sensor ? poses_of(*T_object_sensor, "T_object_sensor") : training_grid();
  const std::vector<glm::dvec2> elements =
      elements_mm ? points_of(*elements_mm, "elements_mm") : digitacts_array();
  const std::optional<Pose> object =
      T_object_robot ? std::optional(pose_of(*T_object_robot, "T_object_robot")) : std::nullopt;
  const std::string shape = letter_or_file.text();
  return to_python(run([&] {
    const Shape made = make_shape(shape);
    Simulator simulator(made, model, elements, seed);
    std::vector<Pose> T_robot_sensor = poses;
    for (Pose& pose : T_robot_sensor) {
      pose = inverse(object.value_or(Pose{})) * pose;
    }
    Recording recording = simulator.touch(T_robot_sensor, object.value_or(Pose{}));
    if (object) {
      recording.object.clear();
      recording.truth = {.object = made.label, .T_object_robot = *object};
    }
    return recording;
  }));
}

/// The next n numbers, each by one call.
template <double (Random::*draw)()>
Result<double, 1> drawn(Random& random, std::size_t n) {
  std::vector<double> numbers(n);
  std::ranges::generate(numbers, [&] { return (random.*draw)(); });
  return owned(std::move(numbers));
}

}  // namespace

void bind_simulation(nb::module_& module) {
  const SensorModel usual;
  nb::class_<SensorModel>(module, "SensorModel",
                          "The simulated sensor, that of the paper's reference [19].")
      .def(nb::init<double, double, double, double, double, double>(), nb::kw_only(),
           "psf_mm"_a = usual.psf_mm, "element_mm"_a = usual.element_mm,
           "pressure_kpa"_a = usual.pressure_kpa, "force_spread"_a = usual.force_spread,
           "gain_spread"_a = usual.gain_spread, "noise_kpa"_a = usual.noise_kpa,
           "psf_mm: standard deviation of the point spread; element_mm: edge of an element;\n"
           "pressure_kpa: mean reading of an element wholly on the shape; force_spread and\n"
           "gain_spread: relative standard deviations of press force and element gain; noise_kpa:\n"
           "standard deviation of the additive noise.")
      .def_ro("psf_mm", &SensorModel::psf_mm)
      .def_ro("element_mm", &SensorModel::element_mm)
      .def_ro("pressure_kpa", &SensorModel::pressure_kpa)
      .def_ro("force_spread", &SensorModel::force_spread)
      .def_ro("gain_spread", &SensorModel::gain_spread)
      .def_ro("noise_kpa", &SensorModel::noise_kpa);
  module.def(
      "simulate", &simulate, "shape"_a, "T_object_sensor"_a = nb::none(), nb::kw_only(),
      "T_object_robot"_a = nb::none(), "elements_mm"_a = nb::none(), "seed"_a = 1,
      "sensor"_a = SensorModel{},
      "Simulates touches of a shape: A to Z, 0 to 9, ring, bar, or a polygon file.\n\n"
      "T_object_sensor [n, 3]: poses of the array about the object, by default training_grid();\n"
      "T_object_robot [3]: the pose of an unknown object, which the recording stores as its\n"
      "truth; by default the object is known and lies at the robot's origin. elements_mm [e, 2]:\n"
      "by default digitacts_array(). The same seed gives the same recording, as in C++.");
  module.def(
      "training_grid", [] { return to_array(training_grid()); },
      "The 192 training poses T_object_sensor of Sec. II, [192, 3] (x_mm, y_mm, theta_rad).");
  module.def(
      "random_poses", [](int n, std::uint64_t seed) { return to_array(random_poses(n, seed)); },
      "n"_a, "seed"_a = 1,
      "n poses T_object_sensor [n, 3], uniform over the training grid's extent and all angles.");
  module.def(
      "random_object_pose", [](std::uint64_t seed) { return to_array(random_object_pose(seed)); },
      "seed"_a = 1, "A T_object_robot [3], uniform over [-10, 10]^2 mm and all angles (Sec. IV).");
  module.def(
      "digitacts_array", [] { return to_array(digitacts_array()); },
      "Element centres of the DigiTacts array, [36, 2] in mm in the sensor frame.");
  module.def(
      "grid_array",
      [](int columns, int rows, double pitch_mm) {
        return to_array(grid_array(columns, rows, pitch_mm));
      },
      "columns"_a, "rows"_a, "pitch_mm"_a,
      "Element centres of a grid about the sensor's origin, [columns * rows, 2] in mm; x varies\n"
      "fastest.");
  // The benchmarks draw their trials from the library's random numbers.
  nb::enum_<Stream>(module, "Stream", "Purpose of random numbers.")
      .value("object_pose", Stream::object_pose)
      .value("touch_order", Stream::touch_order)
      .value("pose_noise", Stream::pose_noise);
  nb::class_<Random>(module, "Random", "Random numbers of a seed and a purpose.")
      .def(nb::init<std::uint64_t, Stream>(), "seed"_a, "stream"_a)
      .def("uniforms", &drawn<&Random::uniform>, "n"_a, "The next n, uniform over [0, 1): [n].")
      .def("normals", &drawn<&Random::normal>, "n"_a, "The next n, standard normal: [n].");
}

}  // namespace palpate::python
