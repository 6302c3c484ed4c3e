#include <tuple>

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/pose.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

/// An axis, which may be given as a tuple.
struct AxisLike : nb::object {
  NB_OBJECT_DEFAULT(AxisLike, nb::object, "Axis | tuple[float, float, int]", any_object)
};

Axis axis_of(const AxisLike& axis, const char* name) {
  return value_of<Axis>(axis, fmt::format("{}: give an Axis or (lower, upper, count), such as "
                                          "(-10.0, 10.0, 25)",
                                          name));
}

std::string axis_text(const Axis& axis) {
  return fmt::format("({:g}, {:g}, {})", axis.lower, axis.upper, axis.count);
}

/// A constructor.
template <typename Class, typename... Numbers>
void from_tuple(Class* self, const std::tuple<Numbers...>& numbers) {
  std::apply([self](Numbers... number) { new (self) Class{number...}; }, numbers);
}

void bind_lattice(nb::module_& module) {
  nb::class_<Axis>(module, "Axis",
                   "`count` bins of equal width over [lower, upper], in mm or radians. A tuple\n"
                   "(lower, upper, count) stands for an axis.")
      .def(nb::init<double, double, int>(), "lower"_a, "upper"_a, "count"_a = 1)
      .def("__init__", &from_tuple<Axis, double, double, int>, "axis"_a)
      .def_rw("lower", &Axis::lower, "Lower edge of the first bin.")
      .def_rw("upper", &Axis::upper, "Upper edge of the last bin.")
      .def_rw("count", &Axis::count, "Number of bins.")
      .def_prop_ro("step", &Axis::step, "Width of a bin.")
      .def("centre", &Axis::centre, "i"_a, "Centre of bin i.")
      .def("__repr__", &repr_of);
  nb::implicitly_convertible<std::tuple<double, double, int>, Axis>();

  nb::class_<PoseLattice>(
      module, "PoseLattice",
      "Regular bins over the planar pose T_object_robot. x and y, in mm, are the coordinates in\n"
      "the object frame of a pivot point given in the robot frame; theta is in radians:\n"
      "p_object = R(theta) (p_robot - pivot) + (x, y).")
      .def(
          "__init__",
          [](PoseLattice* self, const AxisLike& x_mm, const AxisLike& y_mm,
             const AxisLike& theta_rad, const ArrayLike& pivot_mm) {
            const PoseLattice lattice{axis_of(x_mm, "x_mm"), axis_of(y_mm, "y_mm"),
                                      axis_of(theta_rad, "theta_rad"),
                                      point_of(pivot_mm, "pivot_mm")};
            lattice.validate();
            new (self) PoseLattice(lattice);
          },
          "x_mm"_a = PoseLattice{}.x_mm, "y_mm"_a = PoseLattice{}.y_mm,
          "theta_rad"_a = PoseLattice{}.theta_rad, "pivot_mm"_a = nb::make_tuple(0.0, 0.0),
          "Axes as Axis or (lower, upper, count); pivot_mm [2] in the robot frame.\n\n"
          "Raises Error on a count below 1, a reversed range, or a theta range wider than the "
          "circle.")
      .def_ro("x_mm", &PoseLattice::x_mm, "In the object frame.")
      .def_ro("y_mm", &PoseLattice::y_mm, "In the object frame.")
      .def_ro("theta_rad", &PoseLattice::theta_rad, "Angle of T_object_robot.")
      .def_prop_ro("pivot_mm", array_of(&PoseLattice::pivot_mm), "[2] in the robot frame, mm.")
      .def_prop_ro("bins", &PoseLattice::bins, "Number of bins of one object.")
      .def_prop_ro(
          "shape",
          [](const PoseLattice& self) {
            return std::tuple(self.theta_rad.count, self.y_mm.count, self.x_mm.count);
          },
          "(ntheta, ny, nx), the shape of arrays over the bins.")
      .def(
          "T_object_robot",
          [](const PoseLattice& self, std::int64_t bin) {
            if (bin < 0 || bin >= self.bins()) {
              throw nb::index_error(fmt::format("bin {} of {}", bin, self.bins()).c_str());
            }
            return to_array(self.T_object_robot(bin));
          },
          "bin"_a, "Pose [3] (x_mm, y_mm, theta_rad) at a bin's centre; x varies fastest.")
      .def(
          "bin_of",
          [](const PoseLattice& self, const ArrayLike& T_object_robot) {
            return self.bin_of(pose_of(T_object_robot, "T_object_robot"));
          },
          "T_object_robot"_a, "The bin that a pose [3] lies in, or the nearest one.")
      .def("__repr__", [](const PoseLattice& self) { return python::text_of(self); });
}

/// A constructor. Throws Error where the model's numbers are out of range.
template <typename Model, typename... Arguments>
void make_valid(Model* self, Arguments... arguments) {
  const Model model{arguments...};
  model.validate();
  new (self) Model(model);
}

void bind_contact(nb::module_& module) {
  nb::class_<ContactClassifier>(
      module, "ContactClassifier",
      "Eq. 3: In Contact where the pressure exceeds both the threshold and ratio times the\n"
      "touch's largest pressure, No Contact where it is below both, else Unknown.")
      .def("__init__", &make_valid<ContactClassifier, double, double>,
           "threshold"_a = ContactClassifier{}.threshold, "ratio"_a = ContactClassifier{}.ratio,
           "threshold in the recording's pressure unit; ratio in [0, 1).")
      .def_ro("threshold", &ContactClassifier::threshold)
      .def_ro("ratio", &ContactClassifier::ratio)
      .def("__repr__", &repr_of);

  nb::class_<ContactModel>(module, "ContactModel",
                           "How likely a reading is at a place of a map (Eq. 3 and 7).")
      .def("__init__",
           &make_valid<ContactModel, const ContactClassifier&, double, std::optional<double>>,
           "classifier"_a = ContactClassifier{}, "gamma"_a = ContactModel{}.gamma,
           "prior"_a = nb::none(),
           "gamma in [0, 1): how often the classifier answers at random. prior: probability that\n"
           "an unseen place is occupied; by default the maps' own, which must then agree.")
      .def_ro("classifier", &ContactModel::classifier)
      .def_ro("gamma", &ContactModel::gamma)
      .def_ro("prior", &ContactModel::prior)
      .def("__repr__", &repr_of);

  nb::class_<InverseSensorModel>(
      module, "InverseSensorModel",
      "Eq. 4-6: how much one reading changes the log odds of the cells around it.")
      .def("__init__", &make_valid<InverseSensorModel, double, double, double>,
           "spread_mm"_a = InverseSensorModel{}.spread_mm, "peak"_a = InverseSensorModel{}.peak,
           "prior"_a = InverseSensorModel{}.prior,
           "spread_mm: half the standard deviation of the sensor's point spread; peak below 1;\n"
           "prior: p(m), the probability that an unseen cell is occupied.")
      .def_ro("spread_mm", &InverseSensorModel::spread_mm)
      .def_ro("peak", &InverseSensorModel::peak)
      .def_ro("prior", &InverseSensorModel::prior)
      .def("__repr__", &repr_of);

  nb::class_<DisplacementSd>(module, "DisplacementSd",
                             "Standard deviations of a small displacement: of x and y in mm, and "
                             "of the angle in radians.\nA tuple (mm, rad) stands for one.")
      .def(nb::init<double, double>(), "mm"_a = 0.0, "rad"_a = 0.0)
      .def("__init__", &from_tuple<DisplacementSd, double, double>, "sd"_a)
      .def_rw("mm", &DisplacementSd::mm, "Of x and y, in mm.")
      .def_rw("rad", &DisplacementSd::rad, "Of the angle, in radians.")
      .def("__repr__", &repr_of);
  nb::implicitly_convertible<std::tuple<double, double>, DisplacementSd>();
}

void bind_poses(nb::module_& module) {
  module.def(
      "inverse", [](const ArrayLike& T_a_b) { return to_array(inverse(pose_of(T_a_b, "T_a_b"))); },
      "T_a_b"_a, "T_b_a from T_a_b; poses [3] (x_mm, y_mm, theta_rad).");
  module.def(
      "compose",
      [](const ArrayLike& T_a_b, const ArrayLike& T_b_c) {
        return to_array(pose_of(T_a_b, "T_a_b") * pose_of(T_b_c, "T_b_c"));
      },
      "T_a_b"_a, "T_b_c"_a,
      "T_a_c = T_a_b * T_b_c; poses [3] (x_mm, y_mm, theta_rad). Angles add, and are not wrapped.");
  module.def(
      "transform",
      [](const ArrayLike& T_a_b, const ArrayLike& points_mm) {
        const Pose pose = pose_of(T_a_b, "T_a_b");
        std::vector<glm::dvec2> points = points_of(points_mm, "points_mm");
        for (glm::dvec2& point : points) {
          point = pose * point;
        }
        return to_array(points);
      },
      "T_a_b"_a, "points_mm"_a, "Points [n, 2] of frame b in frame a, in mm.");
}

}  // namespace

std::string text_of(const PoseLattice& lattice) {
  return fmt::format("PoseLattice(x_mm={}, y_mm={}, theta_rad={}, pivot_mm=({:g}, {:g}))",
                     axis_text(lattice.x_mm), axis_text(lattice.y_mm), axis_text(lattice.theta_rad),
                     lattice.pivot_mm.x, lattice.pivot_mm.y);
}

std::string text_of(const Pose& pose) {
  return fmt::format("x {:.2f} mm, y {:.2f} mm, theta {:.3f} rad", pose.translation_mm.x,
                     pose.translation_mm.y, pose.theta_rad);
}

void bind_model(nb::module_& module) {
  bind_lattice(module);
  bind_contact(module);
  bind_poses(module);
}

}  // namespace palpate::python
