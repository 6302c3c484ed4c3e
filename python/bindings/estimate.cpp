#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "arrays.hpp"
#include "bindings.hpp"
#include "model/bounding_box.hpp"
#include "palpate/error.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

/// (low, high) of each.
template <typename Interval>
std::vector<std::tuple<double, double>> pairs_of(const std::vector<Interval>& intervals) {
  return column(intervals, [](const Interval& each) { return std::tuple(each.low, each.high); });
}

void bind_mode(nb::module_& module) {
  nb::class_<Mode>(module, "Mode", "The pose of the largest posterior probability (Eq. 15-16).")
      .def_ro("object", &Mode::object, "Index into the maps.")
      .def_ro("bin", &Mode::bin, "Index into the lattice, where the filter has bins.")
      .def_prop_ro("T_object_robot", array_of(&Mode::T_object_robot),
                   "[3] (x_mm, y_mm, theta_rad); the bin's centre, where there is a bin.")
      .def_ro("log_likelihood", &Mode::log_likelihood,
              "Of all touches, without prior weights, in nats.")
      .def("__repr__", &repr_of);

  nb::class_<RefinedPose>(
      module, "RefinedPose",
      "Where the posterior peaks near a mode, to a fraction of a bin, with its uncertainty.")
      .def_prop_ro("T_object_robot", array_of(&RefinedPose::T_object_robot),
                   "[3] (x_mm, y_mm, theta_rad).")
      .def_prop_ro("covariance", array_of(&RefinedPose::covariance),
                   "[3, 3] of (x_mm, y_mm, theta_rad) of T_object_robot.")
      .def_prop_ro(
          "T_robot_object",
          [](const RefinedPose& self) { return to_array(inverse(self).T_robot_object); },
          "[3], the object's frame in the robot's, for a robot to act on.")
      .def_prop_ro(
          "T_robot_object_covariance",
          [](const RefinedPose& self) { return to_array(inverse(self).covariance); },
          "[3, 3] of (x_mm, y_mm, theta_rad) of T_robot_object.")
      .def_prop_ro(
          "sd", [](const RefinedPose& self) { return to_array(inverse(self).sd()); },
          "[3], standard deviations of T_robot_object in mm, mm and rad.")
      .def("__repr__", [](const RefinedPose& self) {
        const auto pose = inverse(self);
        const auto sd = pose.sd();
        return fmt::format(
            "RefinedPose(T_robot_object x {:.2f} +-{:.2f} mm, y {:.2f} +-{:.2f} mm, theta {:.3f} "
            "+-{:.3f} rad)",
            pose.T_robot_object.translation_mm.x, sd[0], pose.T_robot_object.translation_mm.y,
            sd[1], wrap_angle(pose.T_robot_object.theta_rad), sd[2]);
      });
}

void bind_certificate(nb::module_& module) {
  nb::class_<Certificate>(module, "Certificate", "What a search by bounds proves of its estimate.")
      .def_ro("dropped_mass", &Certificate::dropped_mass,
              "Bound of the total variation distance from the posterior over all bins.")
      .def_ro("mode_certain", &Certificate::mode_certain,
              "No bin that was not evaluated can exceed the mode.")
      .def_ro("blocks_bounded", &Certificate::blocks_bounded,
              "Blocks of bins whose bound was computed.")
      .def_ro("bins_evaluated", &Certificate::bins_evaluated, "Bins whose likelihood was computed.")
      .def_prop_ro(
          "log_evidence", [](const Certificate& self) { return pairs_of(self.log_evidence); },
          "(low, high) of every map's log evidence, in nats.")
      .def("__repr__", &repr_of);
}

void bind_estimate_class(nb::module_& module) {
  nb::class_<Estimate>(module, "Estimate", "What the belief says about the unknown object.")
      .def_prop_ro("identity", view_of(&Estimate::identity),
                   "Probability of every map (Eq. 14), [maps]; with `none` sums to 1.")
      .def_prop_ro("log_evidence", view_of(&Estimate::log_evidence),
                   "Log of every map's prior weight times its summed likelihood, in nats but for\n"
                   "a constant, [maps].")
      .def_prop_ro(
          "identity_bounds", [](const Estimate& self) { return pairs_of(self.identity_bounds); },
          "(low, high) of every probability, by bounds; empty where `identity` is exact.")
      .def_ro("certificate", &Estimate::certificate,
              "Of a search by bounds; None of other filters.")
      .def_ro("none", &Estimate::none, "Probability of \"none of these\", where it was asked for.")
      .def_ro("mode", &Estimate::mode, "The pose of the largest posterior probability.")
      .def_ro("contradicted", &Estimate::contradicted,
              "True where empty space explains the touches much better than every map.")
      .def("__repr__", [](const Estimate& self) {
        return fmt::format("Estimate(identity [{:.3f}], mode of object {}: {})",
                           fmt::join(self.identity, ", "), self.mode.object,
                           text_of(self.mode.T_object_robot));
      });
}

void bind_marginals(nb::module_& module) {
  nb::class_<Marginals>(module, "Marginals",
                        "Probabilities of parts of one object's poses, over a grid.")
      .def_ro("grid", &Marginals::grid, "The bins, which may be coarser than those of the belief.")
      .def_prop_ro(
          "xy",
          [](nb::handle_t<Marginals> self) {
            const auto& marginals = nb::cast<const Marginals&>(self);
            return view<double, 2>(marginals.xy.data(),
                                   {static_cast<std::size_t>(marginals.grid.y_mm.count),
                                    static_cast<std::size_t>(marginals.grid.x_mm.count)},
                                   self);
          },
          "Of every (x, y), summed over theta, [ny, nx].")
      .def_prop_ro("theta", view_of(&Marginals::theta),
                   "Of every theta, summed over (x, y), [ntheta].")
      .def("plot", plot_method, "ax"_a = nb::none(), plot_signature,
           "Draws the belief over x and y, in mm, with Matplotlib. Returns the axes.")
      .def("_repr_png_", png_method, png_signature)
      .def("__repr__", [](const Marginals& self) {
        return fmt::format("Marginals(over {})", text_of(self.grid));
      });

  nb::class_<PoseSample>(module, "PoseSample", "An object and its pose, drawn from a belief.")
      .def_ro("object", &PoseSample::object, "Index into the maps.")
      .def_prop_ro("T_object_robot", array_of(&PoseSample::T_object_robot),
                   "[3] (x_mm, y_mm, theta_rad).")
      .def("__repr__", &repr_of);
}

/// A number of every candidate, [n].
template <typename Number>
auto of_each(Number number) {
  return [number](const TouchGains& gains) { return owned(column(gains.each, number)); };
}

void bind_gains(nb::module_& module) {
  nb::class_<TouchGains>(
      module, "TouchGains",
      "What a touch at each of n candidate poses is expected to tell, in nats: estimates, none of\n"
      "them below 0, with standard errors. Unpacks into (identity, pose).")
      .def_prop_ro("identity", of_each(&TouchGain::identity), "[n] about which object it is.")
      .def_prop_ro("pose", of_each(&TouchGain::pose), "[n] about the pose, given the object.")
      .def_prop_ro("both", of_each(&TouchGain::both), "[n] about object and pose together.")
      .def_prop_ro("identity_error",
                   of_each([](const TouchGain& gain) { return gain.standard_error.identity; }),
                   "[n] standard error of identity.")
      .def_prop_ro("pose_error",
                   of_each([](const TouchGain& gain) { return gain.standard_error.pose; }),
                   "[n] standard error of pose.")
      .def_prop_ro("both_error",
                   of_each([](const TouchGain& gain) { return gain.standard_error.both; }),
                   "[n] standard error of both.")
      .def("__iter__", [](const TouchGains& self) -> nb::typed<nb::iterator, Result<double, 1>> {
        return nb::iter(
            nb::make_tuple(of_each(&TouchGain::identity)(self), of_each(&TouchGain::pose)(self)));
      });
}

}  // namespace

std::optional<Hypothesis> hypothesis_in(nb::handle item) {
  if (nb::isinstance<OccupancyGrid>(item)) {
    return Hypothesis{.map = nb::cast<const OccupancyGrid&>(item)};
  }
  return nb::isinstance<Hypothesis>(item) ? std::optional(nb::cast<Hypothesis>(item))
                                          : std::nullopt;
}

std::vector<Hypothesis> hypotheses_of(nb::handle maps) {
  std::vector<Hypothesis> hypotheses;
  const nb::object all = call("builtins", "list", maps);
  for (const nb::handle item : all) {
    const auto hypothesis = hypothesis_in(item);
    if (!hypothesis) {
      throw Error(Fault::input, fmt::format("maps: item {} is a {}; give OccupancyGrid or "
                                            "Hypothesis, such as of read_map()",
                                            hypotheses.size(), nb::inst_name(item).c_str()));
    }
    hypotheses.push_back(*hypothesis);
  }
  return hypotheses;
}

void bind_estimate(nb::module_& module) {
  bind_mode(module);
  bind_certificate(module);
  bind_estimate_class(module);
  bind_marginals(module);
  bind_gains(module);
}

double extent_mm(const std::vector<Hypothesis>& hypotheses) {
  double farthest = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    const BoundingBox box = occupied_box(hypothesis.map);
    farthest = std::max(farthest, glm::length(glm::max(glm::abs(box.lower), glm::abs(box.upper))));
  }
  return farthest;
}

void require_reach(const PoseLattice& lattice, double extent_mm, std::span<const Touch> touches) {
  const PoseLattice usual;
  const auto is_usual = [&](const Axis& axis) {
    return axis.lower == usual.x_mm.lower && axis.upper == usual.x_mm.upper;
  };
  if (!is_usual(lattice.x_mm) || !is_usual(lattice.y_mm) || lattice.pivot_mm != usual.pivot_mm) {
    return;
  }
  for (const Touch& touch : touches) {
    const glm::dvec2 middle = touch.T_robot_sensor * array_centre_mm(touch.elements_mm);
    const double reach_mm = extent_mm + array_reach_mm(touch.elements_mm) +
                            std::hypot(usual.x_mm.upper, usual.y_mm.upper);
    if (glm::length(middle) > reach_mm) {
      throw Error(
          Fault::input,
          fmt::format("lattice or region: missing or the default, within 10 mm of the robot's "
                      "origin, but the array touches at ({:.1f}, {:.1f}) mm, where no object "
                      "can be then; give one of touch_region() or balanced_lattice() and "
                      "move_pivot() to the touch, or use recognize()",
                      middle.x, middle.y));
    }
  }
}

}  // namespace palpate::python
