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

void update_particles(const Particles& self, const TouchesLike& touches, const Progress& progress) {
  TouchViews views = views_of(touches);
  self.use(std::move(views.kept), progress,
           [all = std::move(views.touches)](ParticleFilter& filter, Call& call) {
             filter.update(all, call.progress());
           });
}

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
  return {owned(std::move(objects), {all.size()}), to_array(poses),
          owned(std::move(weights), {all.size()})};
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
            std::vector<Hypothesis> hypotheses = hypotheses_of(maps);
            std::vector<std::string> labels = labels_of(hypotheses);
            new (self) Particles(make_owned<ParticleFilter>(
                                     {}, device,
                                     [hypotheses = std::move(hypotheses), options](Device& on) {
                                       return ParticleFilter(on, hypotheses, options);
                                     }),
                                 std::move(labels));
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
      .def("update", &update_particles, "touches"_a, "progress"_a = nb::none(),
           "Resamples, moves and weighs the particles by each touch in turn (Eq. 7-8).\n\n"
           "After Ctrl-C, or where progress(fraction) raises, call reset(). Raises Error on a "
           "touch\n"
           "that is not sound, of which none is taken in.")
      .def(
          "estimate",
          [](const Particles& self) {
            return self.use([](ParticleFilter& filter, Call&) { return filter.estimate(); });
          },
          "Identity by Eq. 9; the pose is the maximum of the Parzen estimate (Eq. 10-12).")
      .def(
          "reset",
          [](const Particles& self) {
            self.use([](ParticleFilter& filter, Call&) { filter.reset(); });
          },
          "Restores the initial particles for the next unknown.")
      .def(
          "effective_sample_size",
          [](const Particles& self) {
            return self.use(
                [](ParticleFilter& filter, Call&) { return filter.effective_sample_size(); });
          },
          "1 / sum of squared weights, in [1, n].")
      .def("particles", &particles,
           "All particles: objects [n], T_object_robot [n, 3] (x_mm, y_mm, theta_rad) and weights\n"
           "[n], which sum to 1.")
      .def_prop_ro(
          "device_bytes",
          [](const Particles& self) {
            return self.use([](ParticleFilter& filter, Call&) { return filter.device_bytes(); });
          },
          "Device memory held.")
      .def("__repr__", [](const Particles& self) {
        return fmt::format("ParticleFilter({})", text_of(self.labels, self.session()));
      });
}

}  // namespace palpate::python
