#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "estimate.hpp"
#include "palpate/bounded_posterior.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Bounded = Named<BoundedPosterior>;

}  // namespace

void bind_bounded_posterior(nb::module_& module) {
  nb::class_<Bounded>(
      module, "BoundedPosterior",
      "The belief of PoseHistogram over the same bins, of which it evaluates only those that\n"
      "matter, and proves how little the others can. Memory follows the maps, not the bins.")
      .def(
          "__init__",
          [](Bounded* self, const std::shared_ptr<Session>& device, const MapsLike& maps,
             const PoseLattice& lattice, const ContactModel& contact, double tolerance,
             std::optional<double> budget_s, std::optional<double> evidence_nats,
             std::optional<double> none_weight, int threads) {
            const BoundedOptions options{.lattice = lattice,
                                         .contact = contact,
                                         .tolerance = tolerance,
                                         .budget_s = budget_s,
                                         .evidence_nats = evidence_nats,
                                         .none_weight = none_weight,
                                         .threads = threads,
                                         // The belief keeps the session.
                                         .cancel_point = [on = device.get()] { on->check(); }};
            new (self) Bounded(make_filter<BoundedPosterior>(device, maps, options));
          },
          "device"_a, "maps"_a, "lattice"_a = PoseLattice{}, nb::kw_only(),
          "contact"_a = ContactModel{}, "tolerance"_a = BoundedOptions{}.tolerance,
          "budget_s"_a = nb::none(), "evidence_nats"_a = nb::none(), "none_weight"_a = nb::none(),
          "threads"_a = 0,
          "tolerance: largest total variation distance from the posterior over all bins;\n"
          "budget_s: seconds after which estimate() reports what it has proven by then;\n"
          "evidence_nats: bounds every map's log evidence, too; threads: 0 for as many as the\n"
          "machine has cores.\n\n"
          "Raises Error as PoseHistogram does.")
      .def(
          "update", &update<BoundedPosterior>, "touches"_a, "progress"_a = nb::none(),
          "Multiplies the belief by the likelihood of these touches (Eq. 7, 13); takes in none of\n"
          "them after Ctrl-C or where progress(fraction) raises. Raises Error on a touch that is\n"
          "not sound.")
      .def("estimate", on_device<Bounded>(&BoundedPosterior::estimate),
           "Identity with its bounds, mode and certificate. Searches once after each update().\n"
           "After Ctrl-C the belief is as it was, and the next call searches anew.")
      .def("refine", &refine<BoundedPosterior>, "mode"_a = nb::none(),
           "The refined pose near a mode, and its covariance; see PoseHistogram.refine().")
      .def(
          "marginals",
          [](const Bounded& self, int object, const std::optional<PoseLattice>& grid) {
            return self.use([object, grid](BoundedPosterior& belief, Call&) {
              return grid ? belief.marginals(object, *grid) : belief.marginals(object);
            });
          },
          "object"_a, "grid"_a = nb::none(),
          "Marginal probabilities of one object's poses, over the lattice or a coarser grid.")
      .def(
          "log_likelihood",
          [](const Bounded& self, int object, const ArrayLike& T_object_robot) {
            const Pose pose = pose_of(T_object_robot, "T_object_robot");
            return self.use([object, pose](BoundedPosterior& belief, Call&) {
              return belief.log_likelihood(object, pose);
            });
          },
          "object"_a, "T_object_robot"_a,
          "Log-likelihood of any pose [3] of an object in nats, in float64.")
      .def("entropy", on_device<Bounded>(&BoundedPosterior::entropy),
           "Entropy of the belief over objects and evaluated bins, in nats.")
      .def("sample", on_device<Bounded>(&BoundedPosterior::sample), "count"_a, "seed"_a = 0,
           "Draws objects and poses from the belief.")
      .def("reset", on_device<Bounded>(&BoundedPosterior::reset),
           "Returns to the uniform belief, for the next unknown.")
      .def_prop_ro("lattice", on_device<Bounded>(&BoundedPosterior::lattice), "The bins.")
      .def_prop_ro("host_bytes", on_device<Bounded>(&BoundedPosterior::host_bytes), "Memory held.")
      .def("__repr__",
           [](const Bounded& self) { return fmt::format("BoundedPosterior({})", self.name); });
}

}  // namespace palpate::python
