#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "shared.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

/// A filter over object and pose.
template <typename Filter>
struct Named : Shared<Filter> {
  std::string text;         ///< "PoseHistogram(A, E, I on 'llvmpipe')"
  double extent_mm = 0.0;   ///< farthest occupied place of any map from its object frame's origin
  PoseLattice region = {};  ///< as it was given
};

template <typename Filter, typename Options>
Named<Filter> make_filter(const char* name, const std::shared_ptr<Device>& device, nb::handle maps,
                          const Options& options, const PoseLattice& region) {
  const std::vector<Hypothesis> hypotheses = hypotheses_of(maps);
  const auto labels = column(hypotheses, [](const Hypothesis& each) { return each.map.label; });
  auto filter = make_shared_on(device, [&](Device& on) {
    if constexpr (std::is_constructible_v<Filter, Device&, decltype(hypotheses), Options>) {
      return Filter(on, hypotheses, options);
    } else {
      return Filter(hypotheses, options);
    }
  });
  return {std::move(filter),
          fmt::format("{}({} on '{}')", name, fmt::join(labels, ", "), device->name()),
          extent_mm(hypotheses), region};
}

template <typename Filter>
void update(const Named<Filter>& self, const TouchesLike& touches, const Progress& progress) {
  const TouchViews views = views_of(touches);
  self.use(progress, [&](Filter& filter, const Report& report) {
    if constexpr (requires { filter.lattice(); }) {
      require_reach(filter.lattice(), self.extent_mm, views.touches);
    } else {
      require_reach(self.region, self.extent_mm, views.touches);
    }
    filter.update(views.touches, report);
  });
}

/// The refined pose near a mode, by default that of estimate().
template <typename Filter>
RefinedPose refine(const Named<Filter>& self, const std::optional<Mode>& mode) {
  return self.use(
      [&](Filter& belief) { return belief.refine(mode ? *mode : belief.estimate().mode); });
}

/// The bins of one object with their shares.
template <typename Filter>
std::tuple<Result<std::int64_t, 1>, Result<double, 1>> likely_bins(const Named<Filter>& self,
                                                                   int object, double least_share) {
  const auto likely = self.use([&](Filter& belief) {
    return belief.likely_bins(std::span(&object, 1), least_share).front();
  });
  return {owned(column(likely, &BinShare::bin)), owned(column(likely, &BinShare::share))};
}

template <typename Filter>
TouchGains expected_gain(const Named<Filter>& self, const ArrayLike& T_robot_sensor,
                         const ArrayLike& elements_mm, std::size_t samples, std::uint64_t seed) {
  const std::vector<Pose> poses = poses_of(T_robot_sensor, "T_robot_sensor");
  const std::vector<glm::dvec2> elements = points_of(elements_mm, "elements_mm");
  return {self.use([&](Filter& belief) {
    return belief.expected_gain(poses, elements, {.samples = samples, .seed = seed});
  })};
}

using Histogram = Named<PoseHistogram>;

DisplacementSd sd_of(const DisplacementSdLike& sd, const char* name) {
  return value_of<DisplacementSd>(
      sd, fmt::format("{}: give a DisplacementSd or (mm, rad), such as (0.5, 0.02)", name));
}

/// The bins of one object, [ntheta, ny, nx].
Result<double, 3> log_likelihood(const Histogram& self, int object) {
  auto bins = self.use([&](PoseHistogram& belief) { return belief.log_likelihood(object); });
  return owned(std::move(bins), self.constant().lattice());
}

/// What histogram and bounds have alike.
template <typename Belief>
void bind_belief(nb::class_<Named<Belief>> belief) {
  using Own = Named<Belief>;
  belief
      .def("refine", &refine<Belief>, "mode"_a = nb::none(),
           "The refined pose near a mode, by default that of estimate(), and its covariance:\n"
           "where the posterior peaks, to a fraction of a bin.")
      .def("likely_bins", &likely_bins<Belief>, "object"_a, "least_share"_a = 1e-6,
           "The bins that hold at least least_share of the object's belief: indices [n] into the\n"
           "lattice, theta, y, x, x fastest, and the shares [n].")
      .def("entropy", shared_method<Own>(&Belief::entropy),
           "Entropy of the belief over objects and bins, in nats; by bounds over evaluated bins.")
      .def("sample", shared_method<Own>(&Belief::sample), "count"_a, "seed"_a = 0,
           "Draws objects and poses from the belief.")
      .def("expected_gain", &expected_gain<Belief>, "T_robot_sensor"_a, "elements_mm"_a,
           nb::kw_only(), "samples"_a = PlanOptions{}.samples, "seed"_a = 0,
           "What one more touch at each candidate pose [n, 3] is expected to tell, in nats.\n"
           "elements_mm [e, 2]: living elements in the sensor frame.")
      .def("reset", shared_method<Own>(&Belief::reset),
           "Returns to the uniform belief, for the next unknown.")
      .def_prop_ro("lattice", shared_method<Own>(&Belief::lattice), "The bins.")
      .def("__repr__", [](const Own& self) { return self.text; });
}

void bind_histogram(nb::module_& module) {
  const auto belief =
      nb::class_<Histogram>(
          module, "PoseHistogram",
          "Histogram filter over object identity and planar pose (Sec. III-C, Eq. 13-16), on the\n"
          "device. The same input gives the same bits as in C++.")
          .def(
              "__init__",
              [](Histogram* self, const std::shared_ptr<Device>& device, const MapsLike& maps,
                 const PoseLattice& lattice, const ContactModel& contact,
                 std::optional<double> none_weight, const DisplacementSdLike& touch_sd,
                 const DisplacementSdLike& slip_sd) {
                const HistogramOptions options{.lattice = lattice,
                                               .contact = contact,
                                               .none_weight = none_weight,
                                               .touch_sd = sd_of(touch_sd, "touch_sd"),
                                               .slip_sd = sd_of(slip_sd, "slip_sd")};
                new (self) Histogram(
                    make_filter<PoseHistogram>("PoseHistogram", device, maps, options, lattice));
              },
              "device"_a, "maps"_a, "lattice"_a = PoseLattice{}, nb::kw_only(),
              "contact"_a = ContactModel{}, "none_weight"_a = nb::none(),
              "touch_sd"_a = DisplacementSd{}, "slip_sd"_a = DisplacementSd{},
              "Starts with a uniform belief. none_weight: prior weight of \"none of these\";\n"
              "touch_sd: how far the sensor may have been from where it was said to be; slip_sd:\n"
              "how far the object moves between touches.\n\n"
              "Raises Error on maps that are not sound or differ in their prior, on options out\n"
              "of range, and where the device has too little memory.")
          .def("update", &update<PoseHistogram>, "touches"_a, "progress"_a = nb::none(),
               "Multiplies the belief by the likelihood of these touches (Eq. 7, 13).\n\n"
               "progress(fraction) is called up to 20 times a second. After Ctrl-C, or where\n"
               "progress raises, the belief is left half-way: call reset(). Raises Error on a\n"
               "touch that is not sound, of which none is taken in.")
          .def(
              "move_pivot",
              [](const Histogram& self, const ArrayLike& pivot_mm) {
                self.use([pivot = point_of(pivot_mm, "pivot_mm")](PoseHistogram& belief) {
                  belief.move_pivot(pivot);
                });
              },
              "pivot_mm"_a,
              "Turns theta about another pivot [2], in the robot frame, before any touch.")
          .def("estimate", shared_method<Histogram>(&PoseHistogram::estimate),
               "Identity probabilities (Eq. 14) and mode (Eq. 15-16).")
          .def("marginals", shared_method<Histogram>(&PoseHistogram::marginals), "object"_a,
               "Marginal probabilities of one object's poses, over the lattice.")
          .def(
              "log_likelihood", &log_likelihood, "object"_a,
              "Log-likelihood of every bin of one object in nats, [ntheta, ny, nx], without prior\n"
              "weights.")
          .def_prop_ro("device_bytes", shared_method<Histogram>(&PoseHistogram::device_bytes),
                       "Device memory held.");
  bind_belief(belief);
}

using Particles = Named<ParticleFilter>;

std::tuple<Result<std::int32_t, 1>, Result<double, 2>, Result<double, 1>> particles(
    const Particles& self) {
  const auto all = self.use([](ParticleFilter& filter) { return filter.particles(); });
  return {owned(column(all, &ParticleFilter::Particle::object)),
          to_array(column(all, &ParticleFilter::Particle::T_object_robot)),
          owned(column(all, &ParticleFilter::Particle::weight))};
}

void bind_particles(nb::module_& module) {
  nb::enum_<Resampling>(module, "Resampling", "How the next generation of particles is drawn.")
      .value("multinomial", Resampling::multinomial, "n independent draws, as in the paper")
      .value("systematic", Resampling::systematic, "one draw and n - 1 equal steps");

  const ParticleOptions usual;
  nb::class_<Particles>(
      module, "ParticleFilter",
      "Monte Carlo localization over object identity and planar pose (Sec. III-B, Eq. 8-12).")
      .def(
          "__init__",
          [](Particles* self, const std::shared_ptr<Device>& device, const MapsLike& maps,
             const PoseLattice& region, int count, const ContactModel& contact, double motion_mm,
             double motion_rad, Resampling resampling, bool augmented, double alpha_slow,
             double alpha_fast, std::uint64_t seed) {
            const ParticleOptions options{.particles = count,
                                          .region = region,
                                          .contact = contact,
                                          .motion_mm = motion_mm,
                                          .motion_rad = motion_rad,
                                          .resampling = resampling,
                                          .augmented = augmented,
                                          .alpha_slow = alpha_slow,
                                          .alpha_fast = alpha_fast,
                                          .seed = seed};
            new (self) Particles(
                make_filter<ParticleFilter>("ParticleFilter", device, maps, options, region));
          },
          "device"_a, "maps"_a, "region"_a = PoseLattice{}, nb::kw_only(),
          "particles"_a = usual.particles, "contact"_a = usual.contact,
          "motion_mm"_a = usual.motion_mm, "motion_rad"_a = usual.motion_rad,
          "resampling"_a = usual.resampling, "augmented"_a = usual.augmented,
          "alpha_slow"_a = usual.alpha_slow, "alpha_fast"_a = usual.alpha_fast, "seed"_a = 0,
          "Particles start uniformly over the region, whose bin counts are ignored. motion_mm\n"
          "and motion_rad: standard deviations of the noise at each touch; augmented: adds\n"
          "random particles while touches fit worse than before (Augmented MCL).\n\n"
          "Raises Error as PoseHistogram does.")
      .def("update", &update<ParticleFilter>, "touches"_a, "progress"_a = nb::none(),
           "Resamples, moves and weighs the particles by each touch in turn (Eq. 7-8).\n\n"
           "After Ctrl-C, or where progress(fraction) raises, call reset(). Raises Error on a\n"
           "touch that is not sound, of which none is taken in.")
      .def("estimate", shared_method<Particles>(&ParticleFilter::estimate),
           "Identity by Eq. 9; the pose is the maximum of the Parzen estimate (Eq. 10-12).")
      .def("reset", shared_method<Particles>(&ParticleFilter::reset),
           "Restores the initial particles for the next unknown.")
      .def("effective_sample_size",
           shared_method<Particles>(&ParticleFilter::effective_sample_size),
           "1 / sum of squared weights, in [1, n].")
      .def("particles", &particles,
           "All particles: objects [n], T_object_robot [n, 3] (x_mm, y_mm, theta_rad) and\n"
           "weights [n], which sum to 1.")
      .def_prop_ro("device_bytes", shared_method<Particles>(&ParticleFilter::device_bytes),
                   "Device memory held.")
      .def("__repr__", [](const Particles& self) { return self.text; });
}

using Bounded = Named<BoundedPosterior>;

std::tuple<Result<std::int64_t, 1>, Result<double, 1>, double> evaluated_bins(const Bounded& self) {
  EvaluatedBelief bins = self.use([](BoundedPosterior& belief) { return belief.evaluated_bins(); });
  return {owned(std::move(bins.index)), owned(std::move(bins.log_likelihood)),
          bins.rest_mass_bound};
}

void bind_bounded(nb::module_& module) {
  const auto belief =
      nb::class_<Bounded>(
          module, "BoundedPosterior",
          "The belief of PoseHistogram over the same bins, of which it evaluates only those that\n"
          "matter, and proves how little the others can. Memory follows the maps.")
          .def(
              "__init__",
              [](Bounded* self, const std::shared_ptr<Device>& device, const MapsLike& maps,
                 const PoseLattice& lattice, const ContactModel& contact, double tolerance,
                 std::optional<double> budget_s, std::optional<double> evidence_nats,
                 std::optional<double> none_weight, const DisplacementSdLike& touch_sd,
                 int threads) {
                const BoundedOptions options{.lattice = lattice,
                                             .contact = contact,
                                             .touch_sd = sd_of(touch_sd, "touch_sd"),
                                             .tolerance = tolerance,
                                             .budget_s = budget_s,
                                             .evidence_nats = evidence_nats,
                                             .none_weight = none_weight,
                                             .threads = threads,
                                             .cancel_point = check_signals};
                new (self) Bounded(make_filter<BoundedPosterior>("BoundedPosterior", device, maps,
                                                                 options, lattice));
              },
              "device"_a, "maps"_a, "lattice"_a = PoseLattice{}, nb::kw_only(),
              "contact"_a = ContactModel{}, "tolerance"_a = BoundedOptions{}.tolerance,
              "budget_s"_a = nb::none(), "evidence_nats"_a = nb::none(),
              "none_weight"_a = nb::none(), "touch_sd"_a = DisplacementSd{}, "threads"_a = 0,
              "tolerance: largest total variation distance from the posterior over all bins;\n"
              "budget_s: seconds after which estimate() reports what it has proven by then;\n"
              "evidence_nats: bounds every map's log evidence, too; touch_sd: how far off the\n"
              "sensor's poses may be; threads: 0 for as many as the machine has cores.\n\n"
              "Raises Error as PoseHistogram does.")
          .def("update", &update<BoundedPosterior>, "touches"_a, "progress"_a = nb::none(),
               "Multiplies the belief by the likelihood of these touches (Eq. 7, 13); takes in\n"
               "none of them after Ctrl-C or where progress(fraction) raises. Raises Error on a\n"
               "touch that is not sound.")
          .def(
              "estimate", shared_method<Bounded>(&BoundedPosterior::estimate),
              "tolerance"_a = nb::none(),
              "Identity with its bounds, mode and certificate. Searches once after each update(),\n"
              "and again where a call has a smaller tolerance than those before it.\n"
              "tolerance: in place of the one given to the constructor; what else is asked\n"
              "before the next update(), draws included, is about the bins that the last search\n"
              "evaluated. Raises Error on one that is not between 0 and 1.\n"
              "After Ctrl-C the belief is as it was, and the next call searches anew.")
          .def(
              "marginals",
              [](const Bounded& self, int object, const std::optional<PoseLattice>& grid) {
                return self.use([&](BoundedPosterior& belief) {
                  return grid ? belief.marginals(object, *grid) : belief.marginals(object);
                });
              },
              "object"_a, "grid"_a = nb::none(),
              "Marginal probabilities of one object's poses, over the lattice or a coarser grid.")
          .def(
              "log_likelihood",
              [](const Bounded& self, int object, const ArrayLike& T_object_robot) {
                return self.use(
                    [object, pose = pose_of(T_object_robot, "T_object_robot")](
                        BoundedPosterior& belief) { return belief.log_likelihood(object, pose); });
              },
              "object"_a, "T_object_robot"_a,
              "Log-likelihood of any pose [3] of an object in nats, in float64.")
          .def("evaluated_bins", &evaluated_bins,
               "The bins that the search evaluated: indices [n] into [object, theta, y, x], x\n"
               "fastest, log-likelihoods [n] in nats, without prior weights, and a bound of the\n"
               "share of the belief that all other bins hold together.")
          .def_prop_ro("host_bytes", shared_method<Bounded>(&BoundedPosterior::host_bytes),
                       "Memory held.");
  bind_belief(belief);
}

}  // namespace

void bind_filters(nb::module_& module) {
  bind_histogram(module);
  bind_bounded(module);
  bind_particles(module);
}

}  // namespace palpate::python
