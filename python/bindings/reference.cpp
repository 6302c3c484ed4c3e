#include "reference/reference.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include "call.hpp"
#include "palpate/error.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

Result<std::uint8_t, 1> classify(const TouchObject& touch, const ContactClassifier& classifier) {
  const TouchViews views = views_of(touch);
  std::vector<std::uint8_t> classes;
  for (const Reading reading : reference::classify(views.touches.front(), classifier)) {
    classes.push_back(static_cast<std::uint8_t>(reading));
  }
  return owned(std::move(classes));
}

Result<double, 2> log_odds_map(const TouchesLike& touches, const OccupancyGrid& grid,
                               const ContactClassifier& classifier,
                               const InverseSensorModel& sensor) {
  const TouchViews views = views_of(touches);
  auto cells =
      run([&] { return reference::log_odds_map(views.touches, grid, classifier, sensor); });
  return owned(std::move(cells),
               {static_cast<std::size_t>(grid.ny), static_cast<std::size_t>(grid.nx)});
}

double log_likelihood(const TouchObject& touch, const ArrayLike& T_object_robot,
                      const OccupancyGrid& map, const ContactModel& contact) {
  return reference::log_likelihood(views_of(touch).touches.front(),
                                   pose_of(T_object_robot, "T_object_robot"), map, contact);
}

Result<double, 3> log_likelihoods(const TouchesLike& touches, const PoseLattice& lattice,
                                  const OccupancyGrid& map, const ContactModel& contact) {
  lattice.validate();
  const TouchViews views = views_of(touches);
  auto bins = run([&] { return reference::log_likelihoods(views.touches, lattice, map, contact); });
  return owned(std::move(bins), lattice);
}

Result<double, 1> identity(const std::vector<ArrayLike>& log_likelihoods,
                           const std::optional<std::vector<double>>& weights) {
  reference::Posterior posterior;
  ArrayReader reader;
  for (const ArrayLike& bins : log_likelihoods) {
    posterior.log_likelihood.push_back(
        reader.floats(bins, "log_likelihoods", {"ntheta", "ny", "nx"}).copied());
  }
  posterior.weight = weights.value_or(std::vector<double>(log_likelihoods.size(), 1.0));
  if (posterior.weight.size() != log_likelihoods.size()) {
    throw Error(Fault::input, "weights: give one for each object");
  }
  return owned(reference::identity(posterior));
}

}  // namespace

}  // namespace palpate::python

NB_MODULE(reference, module) {
  using namespace palpate;
  using namespace palpate::python;
  nb::module_::import_("palpate._palpate");  // has the types
  module.doc() =
      "The method in plain float64 and in the paper's order: what every kernel is tested against.\n"
      "Slow, and checks nothing but shapes.";
  module.def("classify", &classify, "touch"_a, "classifier"_a = ContactClassifier{},
             "Eq. 3: the class of every element, [e]: 0 No Contact, 1 In Contact, 8 Unknown.");
  module.def("log_odds_map", &log_odds_map, "touches"_a, "grid"_a,
             "classifier"_a = ContactClassifier{}, "sensor"_a = InverseSensorModel{},
             "Eq. 2 and 6: log odds [ny, nx] of the touches on the geometry of a grid, in nats.");
  module.def("log_likelihood", &log_likelihood, "touch"_a, "T_object_robot"_a, "map"_a,
             "contact"_a = ContactModel{}, "Eq. 7 for a touch of a map at a pose [3], in nats.");
  module.def(
      "log_likelihoods", &log_likelihoods, "touches"_a, "lattice"_a, "map"_a,
      "contact"_a = ContactModel{},
      "Eq. 13 in logs: the touches' log-likelihood at every bin, [ntheta, ny, nx], in nats.");
  module.def(
      "identity", &identity, "log_likelihoods"_a, "weights"_a = nb::none(),
      "Eq. 14: probability of every object, from [ntheta, ny, nx] of each and prior weights.");
  module.def(
      "pose_error_mm",
      [](const OccupancyGrid& map, const ArrayLike& estimate, const ArrayLike& truth) {
        return reference::pose_error_mm(map, pose_of(estimate, "estimate"),
                                        pose_of(truth, "truth"));
      },
      "map"_a, "estimate"_a, "truth"_a, "Eq. 17-20, in mm; poses T_object_robot [3].");
}
