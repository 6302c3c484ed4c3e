#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "learning/calibration_task.hpp"
#include "learning/setup_check.hpp"
#include "model/element_spacing.hpp"
#include "model/option_words.hpp"
#include "recognition/recordings.hpp"
#include "request.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

SensorCalibration calibrate(const GivenRecordings& given, PythonRequest request,
                            const CalibrationRequest& wanted, Call& call) {
  const std::vector<Recording> recordings = read_recordings(given);
  if (request.given_maps.empty()) {
    read_maps(request);
  }
  const CalibrationTask task = calibration_task(wanted, request, recordings, request.given_maps);
  return calibrate_sensor(task.presses, task.maps, task.options, call.progress());
}

SetupCheck check(const GivenRecordings& given, const PythonRequest& request, double cell_mm,
                 std::optional<double> spread_mm, Call& call) {
  const std::vector<Recording> recordings = read_recordings(given);
  const Recording& first = recordings.front();
  MapOptions options{.cell_mm = cell_mm,
                     .sensor = {.spread_mm = spread_mm ? *spread_mm : usual_spread_mm(recordings)}};
  options.classifier =
      make_classifier(first.pressure_unit, first.path, request.threshold, request.ratio);
  const auto used = session_on(request.session, request.device);
  auto lock = used->lock(call);
  return check_setup(lock.device(), recordings, options, call.progress());
}

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
            const auto& alone = self.fit_scale ? self.fit_scale->stranger_alone : std::nullopt;
            return alone ? std::optional(std::tuple(alone->mean, alone->sd)) : std::nullopt;
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
            run([sensor = self, path = file.path()](Call&) { write_sensor_model(path, sensor); });
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

}  // namespace

namespace {

void bind_setup_check(nb::module_& module) {
  nb::class_<SetupFinding>(module, "SetupFinding", "Something that is wrong with a set-up.")
      .def_ro("what", &SetupFinding::what,
              "\"pose_unit\", \"element_order\", \"array_offset\", \"pitch\", \"dead_elements\",\n"
              "\"stuck_elements\", \"contradicting\", \"tilt\", \"clock\" or \"dropped\".")
      .def_ro(
          "nats", &SetupFinding::nats,
          "By how much more likely the touches are once it is mended; of \"clock\", log 19 for\n"
          "each press that it explains; 0 of \"tilt\" and \"dropped\".")
      .def_prop_ro(
          "words", [](const SetupFinding& self) { return in_keywords(self.words); },
          "A sentence with what mends it.")
      .def_prop_ro(
          "array_offset",
          [](const SetupFinding& self) {
            return self.array_offset ? std::optional(to_array(*self.array_offset)) : std::nullopt;
          },
          "[3], the array's pose in the true sensor frame, mm, mm and rad; None but for\n"
          "\"array_offset\".")
      .def_ro("sd", &SetupFinding::sd, "Standard deviations of array_offset, or None.")
      .def("__repr__", [](const SetupFinding& self) {
        return fmt::format("SetupFinding('{}', {:.0f} nats: {})", self.what, self.nats,
                           in_keywords(self.words));
      });
  nb::class_<SetupCheck>(module, "SetupCheck", "What touches say about their set-up.")
      .def_ro("findings", &SetupCheck::findings, "Empty where the set-up is sound.")
      .def_ro("remarks", &SetupCheck::remarks, "What these touches cannot tell, in sentences.")
      .def_prop_ro("elements_mm", array_of(&SetupCheck::elements_mm),
                   "[e, 2], the array as the findings correct it.")
      .def_ro("touches", &SetupCheck::touches, "How many touches were in contact.");
  module.def(
      "check_setup",
      [](nb::handle recordings, const PythonRequest& request, double cell_mm,
         std::optional<double> spread_mm, const Progress& progress) {
        return run({}, progress, [=, given = given_recordings(recordings)](Call& call) {
          return check(given, request, cell_mm, spread_mm, call);
        });
      },
      "recordings"_a, "request"_a, "cell_mm"_a, "spread_mm"_a.none(), "progress"_a = nb::none(),
      "What the touches say; of the request count the classifier and the device.");
}

}  // namespace

void bind_calibration(nb::module_& module) {
  bind_setup_check(module);
  bind_learned_sensor(module);
  nb::class_<GroupScores>(module, "GroupScores",
                          "The cross-validation of several touches of one object at a time.")
      .def_ro("touches", &GroupScores::touches, "Touches of a group.")
      .def_ro("before", &GroupScores::before, "Eq. 7 with gamma 0.1, temperature 1.")
      .def_ro("table", &GroupScores::table, "The table, temperature 1.")
      .def_ro("after", &GroupScores::after, "The table and the temperature.");
  nb::class_<SensorCalibration>(
      module, "SensorCalibration",
      "A learned sensor and how good it is on touches that it has not seen, by cross-validation.\n"
      "With one object there is none to compare by, and `before` to `groups` are None.")
      .def_ro("sensor", &SensorCalibration::sensor, "What was learned.")
      .def_ro("array_offset", &SensorCalibration::array_offset,
              "Where the array sits in the tool, a SetupFinding, from touches at known poses of\n"
              "objects whose maps are drawn; all else is learned with the array there. None where\n"
              "it sits where the recordings say.")
      .def_ro("objects", &SensorCalibration::objects, "Number of objects.")
      .def_prop_ro(
          "tried",
          [](const SensorCalibration& self) {
            std::vector<std::tuple<std::string, std::size_t, double>> tried;
            for (const TriedTable& table : self.tried) {
              tried.emplace_back(layer_word(table.kind.layer), table.kind.levels, table.log_loss);
            }
            return tried;
          },
          "(layer, levels, log-loss in nats) of the tables that were tried.")
      .def_ro("before", &SensorCalibration::before, "Eq. 7 with gamma 0.1, temperature 1.")
      .def_ro("table", &SensorCalibration::table, "The table, temperature 1.")
      .def_ro("after", &SensorCalibration::after, "The table, temperature and press features.")
      .def_ro("groups", &SensorCalibration::groups,
              "Several touches at a time; None at unknown poses, or for few touches.")
      .def_ro("warnings", &SensorCalibration::warnings, "What could not be learned, in sentences.")
      .def("__repr__", [](const SensorCalibration& self) {
        return fmt::format(
            "SensorCalibration({} object{}{})", self.objects, self.objects == 1 ? "" : "s",
            self.after
                ? fmt::format(", {} of {} touches right", self.after->right, self.after->records)
                : "");
      });
  nb::class_<CalibrationRequest>(
      module, "CalibrationRequest",
      "What is asked of a calibration beside a Request's maps, classifier, bins and frames.")
      .def(nb::init<>())
      .def_rw("unposed", &CalibrationRequest::unposed)
      .def_rw("layer", &CalibrationRequest::layer)
      .def_rw("levels", &CalibrationRequest::levels)
      .def_rw("max_maps", &CalibrationRequest::max_maps)
      .def_rw("group", &CalibrationRequest::group);
  module.def(
      "calibrate",
      [](nb::handle recordings, const PythonRequest& request, const CalibrationRequest& wanted,
         const Progress& progress) {
        return run({}, progress, [=, given = given_recordings(recordings)](Call& call) {
          return calibrate(given, request, wanted, call);
        });
      },
      "recordings"_a, "request"_a, "calibration"_a, "progress"_a = nb::none(),
      "The calibration; of the request count the maps, classifier, bins, frames and device.");
}

}  // namespace palpate::python
