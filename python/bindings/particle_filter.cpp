#include <fmt/format.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>

#include "bindings.hpp"
#include "estimate.hpp"
#include "palpate/particle_filter.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Particles = Named<ParticleFilter>;

std::tuple<Result<std::int32_t, 1>, Result<double, 2>, Result<double, 1>> particles(
    const Particles& self) {
  const auto all = self.use([](ParticleFilter& filter, Call&) { return filter.particles(); });
  std::vector<std::int32_t> objects;
  std::vector<Pose> poses;
  std::vector<double> weights;
  for (const ParticleFilter::Particle& particle : all) {
    objects.push_back(particle.object);
    poses.push_back(particle.T_object_robot);
    weights.push_back(particle.weight);
  }
  return {owned(std::move(objects)), to_array(poses), owned(std::move(weights))};
}

}  // namespace

void bind_particle_filter(nb::module_& module) {
  nb::enum_<Resampling>(module, "Resampling", "How the next generation of particles is drawn.")
      .value("multinomial", Resampling::multinomial, "n independent draws, as in the paper")
      .value("systematic", Resampling::systematic, "one draw and n - 1 equal steps");

  nb::class_<Particles>(
      module, "ParticleFilter",
      "Monte Carlo localization over object identity and planar pose (Sec. III-B, Eq. 8-12).")
      .def(
          "__init__",
          [](Particles* self, const std::shared_ptr<Session>& device, const MapsLike& maps,
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
            new (self) Particles(make_filter<ParticleFilter>(device, maps, options));
          },
          "device"_a, "maps"_a, "region"_a = PoseLattice{}, nb::kw_only(),
          "particles"_a = ParticleOptions{}.particles, "contact"_a = ContactModel{},
          "motion_mm"_a = ParticleOptions{}.motion_mm,
          "motion_rad"_a = ParticleOptions{}.motion_rad, "resampling"_a = Resampling::multinomial,
          "augmented"_a = false, "alpha_slow"_a = ParticleOptions{}.alpha_slow,
          "alpha_fast"_a = ParticleOptions{}.alpha_fast, "seed"_a = 0,
          "Particles start uniformly over the region, whose bin counts are ignored. motion_mm and\n"
          "motion_rad: standard deviations of the noise at each touch; augmented: adds random\n"
          "particles while touches fit worse than before (Augmented MCL).\n\n"
          "Raises Error as PoseHistogram does.")
      .def("update", &update<ParticleFilter>, "touches"_a, "progress"_a = nb::none(),
           "Resamples, moves and weighs the particles by each touch in turn (Eq. 7-8).\n\n"
           "After Ctrl-C, or where progress(fraction) raises, call reset(). Raises Error on a\n"
           "touch that is not sound, of which none is taken in.")
      .def("estimate", on_device<Particles>(&ParticleFilter::estimate),
           "Identity by Eq. 9; the pose is the maximum of the Parzen estimate (Eq. 10-12).")
      .def("reset", on_device<Particles>(&ParticleFilter::reset),
           "Restores the initial particles for the next unknown.")
      .def("effective_sample_size", on_device<Particles>(&ParticleFilter::effective_sample_size),
           "1 / sum of squared weights, in [1, n].")
      .def("particles", &particles,
           "All particles: objects [n], T_object_robot [n, 3] (x_mm, y_mm, theta_rad) and weights\n"
           "[n], which sum to 1.")
      .def_prop_ro("device_bytes", on_device<Particles>(&ParticleFilter::device_bytes),
                   "Device memory held.")
      .def("__repr__",
           [](const Particles& self) { return fmt::format("ParticleFilter({})", self.name); });
}

}  // namespace palpate::python
