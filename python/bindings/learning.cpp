// `palpate calibrate`, `palpate check` and `palpate map`.

#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "learning/map_task.hpp"
#include "learning/sensor_calibration.hpp"
#include "learning/setup_check.hpp"
#include "model/element_spacing.hpp"
#include "model/option_words.hpp"
#include "recognition/record_json.hpp"
#include "recognition/recordings.hpp"
#include "request.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Json = nlohmann::ordered_json;

std::string layer_word(MapLayer layer) {
  return layer == MapLayer::mean_level ? "mean_level" : "log_odds";
}

void bind_learned_sensor(nb::module_& module) {
  nb::class_<LearnedSensor>(module, "LearnedSensor",
                            "What calibrate() learned about a sensor and the objects that it "
                            "touched.")
      .def_ro("pressure_unit", &LearnedSensor::pressure_unit, "\"kPa\" or \"raw\".")
      .def_ro("noise", &LearnedSensor::noise,
              "Standard deviation of an untouched element, in pressure_unit.")
      .def_ro("classifier", &LearnedSensor::classifier, "Contact threshold and ratio (Eq. 3).")
      .def_ro("gamma", &LearnedSensor::gamma, "Of Eq. 7.")
      .def_ro("prior", &LearnedSensor::prior, "Of new maps.")
      .def_ro("spread_mm", &LearnedSensor::spread_mm, "Of new maps.")
      .def_ro("touch_sd", &LearnedSensor::touch_sd,
              "How far touches lie from their poses; 0 where that cannot be told.")
      .def_ro("temperature", &LearnedSensor::temperature,
              "A label's probability is its evidence to the power of 1 / temperature, normalised.")
      .def_ro("temperature_growth", &LearnedSensor::temperature_growth,
              "More of it for every touch after the first.")
      .def_prop_ro(
          "stranger_sd",
          [](const LearnedSensor& self) {
            return self.fit_scale ? self.fit_scale->stranger_sd : std::nullopt;
          },
          "What every touch after the first adds to the standard deviation of fit.z where the\n"
          "object was never learned; None where fewer than three objects tell it, at known poses:\n"
          "then recognition takes 4.")
      .def_prop_ro(
          "stranger_alone",
          [](const LearnedSensor& self) {
            const auto& fit = self.fit_scale ? self.fit_scale->stranger_single_touch : std::nullopt;
            return fit ? std::optional(std::tuple(fit->mean, fit->sd)) : std::nullopt;
          },
          "(mean, standard deviation) of fit.z of one touch where the object was never learned;\n"
          "None where fewer than three objects tell it.")
      .def_prop_ro(
          "layer", [](const LearnedSensor& self) { return layer_word(self.table->layer.of); },
          "What of a map readings are compared with: \"mean_level\" or \"log_odds\".")
      .def_prop_ro(
          "level_edges",
          [](const LearnedSensor& self) {
            return owned(std::vector<double>(self.table->level_edges));
          },
          "[levels - 2] ascending pressures that part In Contact into levels.")
      .def_prop_ro(
          "log_likelihood",
          [](const LearnedSensor& self) {
            return owned(std::vector<double>(self.table->shared),
                         {self.table->levels(), static_cast<std::size_t>(ReadingLayer::nodes)});
          },
          "[levels, nodes] log P(level | layer) in nats, of all objects together.")
      .def("plot", plot_method, "ax"_a = nb::none(), plot_signature,
           "Draws the probability of each level of reading over what the map says, with\n"
           "Matplotlib. Returns the axes.")
      .def(
          "save",
          [](const LearnedSensor& self, const PathLike& file) {
            run([&, path = file.path()] { write_sensor_model(path, self); });
          },
          "path"_a,
          "Writes the sensor model (YAML), which recognize() and the commands take. Raises Error\n"
          "where it cannot be written.")
      .def("__repr__", [](const LearnedSensor& self) {
        return fmt::format(
            "LearnedSensor(threshold={:.3g} {}, ratio={:.3g}, {} levels over {}, "
            "temperature={:.3g})",
            self.classifier.threshold, self.pressure_unit, self.classifier.ratio,
            self.table->levels(), layer_word(self.table->layer.of), self.temperature);
      });
}

Json to_json(const ComparedScores& scores) {
  return {{"before", to_json(scores.before)},
          {"table", to_json(scores.table)},
          {"after", to_json(scores.after)}};
}

Json to_json(const SensorCalibration& calibration) {
  Json json{{"objects", calibration.objects}, {"tried", Json::array()}};
  for (const TriedTable& table : calibration.tried) {
    json["tried"].push_back({{"layer", layer_word(table.kind.layer)},
                             {"levels", table.kind.levels},
                             {"log_loss", table.log_loss}});
  }
  if (calibration.touches) {
    json.update(to_json(*calibration.touches));
  }
  if (calibration.groups) {
    json["groups"] = {{"touches", presses_in_group}};
    json["groups"].update(to_json(*calibration.groups));
  }
  if (calibration.array_offset) {
    json["array_offset"] = to_json(*calibration.array_offset, in_keywords);
  }
  json["warnings"] = calibration.warnings;
  return json;
}

std::tuple<Fields, LearnedSensor> calibrate(nb::handle given, PythonRequest request,
                                            const CalibrationRequest& wanted,
                                            const Progress& progress) {
  const std::vector<Recording> recordings = recordings_of(given);
  const SensorCalibration calibration = run(progress, [&](const Report& report) {
    if (request.given_maps.empty()) {
      read_maps(request);
    }
    const CalibrationTask task = calibration_task(wanted, request, recordings, request.given_maps);
    return calibrate_sensor(task.presses, task.maps, task.options, report);
  });
  return {fields_of(to_json(calibration)), calibration.sensor};
}

Fields check(nb::handle given, const PythonRequest& request, double cell_mm,
             std::optional<double> spread_mm, const Progress& progress) {
  const std::vector<Recording> recordings = recordings_of(given);
  const SetupCheck check = run(progress, [&](const Report& report) {
    const Recording& first = recordings.front();
    const MapOptions options{
        .cell_mm = cell_mm,
        .sensor = {.spread_mm = spread_mm ? *spread_mm : usual_spread_mm(recordings)},
        .classifier =
            make_classifier(first.pressure_unit, first.path, request.threshold, request.ratio)};
    const auto device = device_of(request.open_device, request.device);
    return check_setup(*device, recordings, options, report);
  });
  Json json{{"findings", Json::array()},
            {"remarks", in_python(check.remarks)},
            {"elements_mm", Json::array()},
            {"touches", check.touches}};
  for (const SetupFinding& finding : check.findings) {
    json["findings"].push_back(to_json(finding, in_keywords));
  }
  for (const glm::dvec2& p : check.elements_mm) {
    json["elements_mm"].push_back({p.x, p.y});
  }
  return fields_of(json);
}

using Learned =
    std::tuple<std::vector<OccupancyGrid>, std::optional<LearnedSensor>, Sentences, Sentences>;

Learned learn(nb::handle given, const PythonRequest& shared, MapRequest request,
              const Progress& progress) {
  request.shared = shared;
  const std::vector<Recording> recordings = recordings_of(given);
  LearnedMaps learned = run(progress, [&](const Report& report) {
    const MapTask task = map_task(request, recordings);
    std::shared_ptr<Device> device;
    const auto open = [&]() -> Device& {
      device = device_of(shared.open_device, request.shared.device);
      return *device;
    };
    LearnedMaps made = learn_maps(task, open, report);
    made.remarks.insert(made.remarks.begin(), task.remarks.begin(), task.remarks.end());
    if (!request.output.empty()) {
      save(request, made);
    }
    return made;
  });
  std::vector<OccupancyGrid> maps;
  for (auto& [name, map] : learned.maps) {
    maps.push_back(std::move(map));
  }
  return {std::move(maps), std::move(learned.sensor), in_python(std::move(learned.words)),
          in_python(std::move(learned.remarks))};
}

void bind_maps_learned(nb::module_& module) {
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
  module.def("learn_maps", &learn, "recordings"_a, "request"_a, "maps"_a, "progress"_a = nb::none(),
             "The maps, the sensor, what is said of them, and what is worth a warning.");
}

}  // namespace

void bind_learning(nb::module_& module) {
  bind_learned_sensor(module);
  nb::class_<CalibrationRequest>(
      module, "CalibrationRequest",
      "What is asked of a calibration beside a Request's maps, classifier, bins and frames.")
      .def(nb::init<>())
      .def_rw("unposed", &CalibrationRequest::unposed)
      .def_rw("layer", &CalibrationRequest::layer)
      .def_rw("levels", &CalibrationRequest::levels)
      .def_rw("max_maps", &CalibrationRequest::max_maps)
      .def_rw("group", &CalibrationRequest::group);
  module.def("calibrate", &calibrate, "recordings"_a, "request"_a, "calibration"_a,
             "progress"_a = nb::none(),
             "What was learned, and the sensor; of the request count the maps, classifier, bins,\n"
             "frames and device.");
  module.def("check_setup", &check, "recordings"_a, "request"_a, "cell_mm"_a, "spread_mm"_a.none(),
             "progress"_a = nb::none(),
             "What the touches say; of the request count the classifier and the device.");
  bind_maps_learned(module);
}

}  // namespace palpate::python
