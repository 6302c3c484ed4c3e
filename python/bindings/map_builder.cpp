#include <fmt/format.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/shared_ptr.h>

#include "bindings.hpp"
#include "palpate/map_builder.hpp"
#include "session.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Builder = Owned<MapBuilder>;

/// Touches that are added at once: some milliseconds of work, after which a call can stop.
constexpr std::size_t batch = 200;

void add_touches(const Builder& builder, const TouchesLike& touches, const Progress& progress) {
  TouchViews views = views_of(touches);
  builder.use(std::move(views.kept), progress,
              [all = std::move(views.touches)](MapBuilder& target, Call& call) {
                const std::span<const Touch> span = all;
                const auto report = call.progress();
                for (std::size_t begin = 0; begin < span.size(); begin += batch) {
                  report(static_cast<double>(begin) / static_cast<double>(span.size()));
                  target.add(span.subspan(begin, std::min(batch, span.size() - begin)));
                }
              });
}

MapOptions options_of(double cell_mm, const InverseSensorModel& sensor,
                      const ContactClassifier& classifier) {
  return {.cell_mm = cell_mm, .sensor = sensor, .classifier = classifier};
}

}  // namespace

void bind_map_builder(nb::module_& module) {
  nb::class_<Builder>(
      module, "MapBuilder",
      "Builds an object's map from touches at known poses (Sec. II, Eq. 4-6), in any order. The\n"
      "object frame is the robot frame of the touches.")
      .def(
          "__init__",
          [](Builder* self, const std::shared_ptr<Session>& device, double cell_mm,
             const InverseSensorModel& sensor, const ContactClassifier& classifier) {
            const MapOptions options = options_of(cell_mm, sensor, classifier);
            new (self) Builder(make_owned<MapBuilder>(
                device, [options](Device& on) { return MapBuilder(on, options); }));
          },
          "device"_a, nb::kw_only(), "cell_mm"_a = MapOptions{}.cell_mm,
          "sensor"_a = InverseSensorModel{}, "classifier"_a = ContactClassifier{},
          "cell_mm: edge of a cell. Raises Error on options out of range.")
      .def("add", &add_touches, "touches"_a, "progress"_a = nb::none(),
           "Adds the evidence of these touches.\n\n"
           "progress(fraction) is called up to 50 times a second. Ctrl-C stops the call after a\n"
           "part of the touches. Raises Error on a touch that is not sound.")
      .def("build", on_device<Builder>(&MapBuilder::build), "label"_a,
           "The map of all touches so far. Raises Error if no element of any touch was In Contact\n"
           "or No Contact.")
      .def("clear", on_device<Builder>(&MapBuilder::clear),
           "Forgets all touches, for the next object.")
      .def("__repr__", [](const Builder& self) {
        return fmt::format("MapBuilder(on '{}')", self.session().name());
      });
  module.def(
      "estimate_prior",
      [](const std::shared_ptr<Session>& session, const std::map<std::string, TouchesLike>& objects,
         double cell_mm, const InverseSensorModel& sensor, const ContactClassifier& classifier) {
        std::vector<nb::object> kept;
        std::vector<ObjectTouches> all;
        for (const auto& [label, touches] : objects) {
          TouchViews views = views_of(touches);
          all.push_back({label, std::move(views.touches)});
          kept.insert(kept.end(), views.kept.begin(), views.kept.end());
        }
        const MapOptions options = options_of(cell_mm, sensor, classifier);
        return run(std::move(kept), Progress(),
                   [session, all = std::move(all), options](Call& call) {
                     auto lock = session->lock(call);
                     return estimate_prior(lock.device(), all, options);
                   });
      },
      "device"_a, "objects"_a, nb::kw_only(), "cell_mm"_a = MapOptions{}.cell_mm,
      "sensor"_a = InverseSensorModel{}, "classifier"_a = ContactClassifier{},
      "p(m) as in the paper: occupied area over modelled area, pooled over all objects, which are\n"
      "touches by label.");
}

}  // namespace palpate::python
