// `palpate map`.

#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "learning/map_task.hpp"
#include "request.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

LearnedMaps learn(const std::vector<Recording>& recordings, const MapRequest& request,
                  const std::shared_ptr<Device>& open_device, const Report& report) {
  const MapTask task = map_task(request, recordings);
  std::shared_ptr<Device> device;
  LearnedMaps learned = learn_maps(
      task,
      [&]() -> Device& {
        device = device_of(open_device, request.shared.device);
        return *device;
      },
      report);
  learned.remarks.insert(learned.remarks.begin(), task.remarks.begin(), task.remarks.end());
  if (!request.output.empty()) {
    save(request, learned);
  }
  return learned;
}

using Learned = std::tuple<std::vector<OccupancyGrid>, std::optional<LearnedSensor>, Sentences>;

}  // namespace

void bind_map_learning(nb::module_& module) {
  nb::class_<MapRequest>(module, "MapRequest", "What is asked of maps beside a Request's options.")
      .def(nb::init<>())
      .def_rw("output", &MapRequest::output)
      .def_rw("cell_mm", &MapRequest::cell_mm)
      .def_rw("spread_mm", &MapRequest::spread_mm)
      .def_rw("peak", &MapRequest::peak)
      .def_rw("prior", &MapRequest::prior)
      .def_rw("origin", &MapRequest::origin)
      .def_rw("symmetry", &MapRequest::symmetry)
      .def_rw("mirror", &MapRequest::mirror)
      .def_rw("label", &MapRequest::label)
      .def_rw("group", &MapRequest::group)
      .def_rw("unposed", &MapRequest::unposed)
      .def_rw("max_maps", &MapRequest::max_maps);
  module.def(
      "learn_maps",
      [](nb::handle given, const PythonRequest& shared, MapRequest request,
         const Progress& progress) {
        request.shared = shared;
        const std::vector<Recording> recordings = recordings_of(given);
        LearnedMaps learned = run(progress, [&](const Report& report) {
          return learn(recordings, request, shared.open_device, report);
        });
        Learned result{{}, std::move(learned.sensor), in_python(std::move(learned.words))};
        for (auto& [name, map] : learned.maps) {
          std::get<0>(result).push_back(std::move(map));
        }
        return std::tuple_cat(std::move(result), std::tuple(in_python(std::move(learned.remarks))));
      },
      "recordings"_a, "request"_a, "maps"_a, "progress"_a = nb::none(),
      "The maps, the sensor, what is said of them, and what is worth a warning.");
}

}  // namespace palpate::python
