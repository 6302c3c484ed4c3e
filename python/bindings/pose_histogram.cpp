#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "estimate.hpp"
#include "palpate/pose_histogram.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Histogram = Named<PoseHistogram>;

DisplacementSd sd_of(const DisplacementSdLike& sd, const char* name) {
  return value_of<DisplacementSd>(
      sd, fmt::format("{}: give a DisplacementSd or (mm, rad), such as (0.5, 0.02)", name));
}

/// The bins of one object, [ntheta, ny, nx].
Result<double, 3> log_likelihood(const Histogram& self, int object) {
  auto bins =
      self.use([object](PoseHistogram& belief, Call&) { return belief.log_likelihood(object); });
  return owned(std::move(bins), self.constant().lattice());
}

/// A number of every candidate, [n].
template <typename Number>
auto of_each(Number number) {
  return [number](const TouchGains& gains) {
    std::vector<double> numbers;
    std::ranges::transform(gains.each, std::back_inserter(numbers), number);
    return owned(std::move(numbers));
  };
}

TouchGains expected_gain(const Histogram& self, const ArrayLike& T_robot_sensor,
                         const ArrayLike& elements_mm, std::size_t samples, std::uint64_t seed) {
  return {self.use([poses = poses_of(T_robot_sensor, "T_robot_sensor"),
                    elements = points_of(elements_mm, "elements_mm"), samples,
                    seed](PoseHistogram& belief, Call&) {
    return belief.expected_gain(poses, elements, {.samples = samples, .seed = seed});
  })};
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

void bind_pose_histogram(nb::module_& module) {
  bind_gains(module);
  nb::class_<Histogram>(
      module, "PoseHistogram",
      "Histogram filter over object identity and planar pose (Sec. III-C, Eq. 13-16), on the\n"
      "device. The same input gives the same bits as in C++.")
      .def(
          "__init__",
          [](Histogram* self, const std::shared_ptr<Session>& device, const MapsLike& maps,
             const PoseLattice& lattice, const ContactModel& contact, bool still_array,
             std::optional<double> none_weight, const DisplacementSdLike& touch_sd,
             const DisplacementSdLike& slip_sd, std::optional<std::uint64_t> memory_limit_bytes) {
            const HistogramOptions options{.lattice = lattice,
                                           .contact = contact,
                                           .still_array = still_array,
                                           .none_weight = none_weight,
                                           .touch_sd = sd_of(touch_sd, "touch_sd"),
                                           .slip_sd = sd_of(slip_sd, "slip_sd"),
                                           .memory_limit_bytes = memory_limit_bytes};
            new (self) Histogram(make_filter<PoseHistogram>(device, maps, options));
          },
          "device"_a, "maps"_a, "lattice"_a = PoseLattice{}, nb::kw_only(),
          "contact"_a = ContactModel{}, "still_array"_a = false, "none_weight"_a = nb::none(),
          "touch_sd"_a = DisplacementSd{}, "slip_sd"_a = DisplacementSd{},
          "memory_limit_bytes"_a = nb::none(),
          "Starts with a uniform belief. still_array: the array stays in one place; none_weight:\n"
          "prior weight of \"none of these\"; touch_sd: how far the sensor may have been from\n"
          "where it was said to be; slip_sd: how far the object moves between touches.\n\n"
          "Raises Error on maps that are not sound or differ in their prior, on options out of\n"
          "range, and where the device has too little memory.")
      .def(
          "update", &update<PoseHistogram>, "touches"_a, "progress"_a = nb::none(),
          "Multiplies the belief by the likelihood of these touches (Eq. 7, 13).\n\n"
          "progress(fraction) is called up to 50 times a second. After Ctrl-C, or where progress\n"
          "raises, the belief is left half-way: call reset(). Raises Error on a touch that is not\n"
          "sound, of which none is taken in.")
      .def("reset", on_device<Histogram>(&PoseHistogram::reset),
           "Returns to the uniform belief, for the next unknown.")
      .def(
          "move_pivot",
          [](const Histogram& self, const ArrayLike& pivot_mm) {
            self.use([pivot = point_of(pivot_mm, "pivot_mm")](PoseHistogram& belief, Call&) {
              belief.move_pivot(pivot);
            });
          },
          "pivot_mm"_a,
          "Turns theta about another pivot [2], in the robot frame, before any touch.")
      .def("estimate", on_device<Histogram>(&PoseHistogram::estimate),
           "Identity probabilities (Eq. 14) and mode (Eq. 15-16).")
      .def("refine", &refine<PoseHistogram>, "mode"_a = nb::none(),
           "The refined pose near a mode, by default that of estimate(), and its covariance:\n"
           "where the posterior peaks, to a fraction of a bin.")
      .def("marginals", on_device<Histogram>(&PoseHistogram::marginals), "object"_a,
           "Marginal probabilities of one object's poses, over the lattice.")
      .def("log_likelihood", &log_likelihood, "object"_a,
           "Log-likelihood of every bin of one object in nats, [ntheta, ny, nx], without prior\n"
           "weights.")
      .def("entropy", on_device<Histogram>(&PoseHistogram::entropy),
           "Entropy of the belief over objects and bins, in nats.")
      .def("sample", on_device<Histogram>(&PoseHistogram::sample), "count"_a, "seed"_a = 0,
           "Draws objects and poses from the belief.")
      .def("expected_gain", &expected_gain, "T_robot_sensor"_a, "elements_mm"_a, nb::kw_only(),
           "samples"_a = PlanOptions{}.samples, "seed"_a = 0,
           "What one more touch at each candidate pose [n, 3] is expected to tell, in nats.\n"
           "elements_mm [e, 2]: living elements in the sensor frame.")
      .def_prop_ro("lattice", on_device<Histogram>(&PoseHistogram::lattice), "The bins.")
      .def_prop_ro("device_bytes", on_device<Histogram>(&PoseHistogram::device_bytes),
                   "Device memory held.")
      .def("__repr__",
           [](const Histogram& self) { return fmt::format("PoseHistogram({})", self.name); });
}

}  // namespace palpate::python
