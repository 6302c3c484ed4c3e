#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "call.hpp"
#include "model/option_words.hpp"
#include "streaming/table_import.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

/// What the summary of the command says that a user may not have meant.
std::vector<std::string> remarks_on(const ImportedRecording& imported,
                                    const ImportOptions& options) {
  std::vector<std::string> remarks;
  if (imported.in_gaps > 0) {
    remarks.push_back(
        fmt::format("{}: {} of its frames have no pose, as the poses around them are more than "
                    "{:.3g} s apart (largest_gap_s)",
                    options.pressures, imported.in_gaps, imported.largest_gap_s));
  }
  if (imported.holds_poses && options.poses.empty()) {
    remarks.push_back(fmt::format("{}: its columns of poses were left out; give it as poses, too",
                                  options.pressures));
  }
  if (imported.assumed_units) {
    remarks.push_back(
        fmt::format("{}: poses taken to be in mm and rad; give pose_unit", options.poses));
  }
  for (const std::string& words : imported.of_poses) {
    remarks.push_back(fmt::format("{}: {}", options.poses, in_keywords(words)));
  }
  if (imported.whole_up_to) {
    remarks.push_back(
        fmt::format("{}: its readings are whole numbers up to {:.0f}: give "
                    "pressure_unit='raw' where they are not kPa",
                    options.pressures, *imported.whole_up_to));
  }
  return remarks;
}

std::tuple<ArrayRecording, std::vector<std::string>> import_python(
    ImportOptions options, const std::optional<ArrayLike>& elements_mm) {
  if (elements_mm) {
    options.elements_mm = points_of(*elements_mm, "array");
  }
  ImportedRecording imported = run([options](Call&) { return import_tables(options); });
  std::vector<std::string> remarks = remarks_on(imported, options);
  return {array_recording(std::move(imported.recording)), std::move(remarks)};
}

}  // namespace

void bind_import(nb::module_& module) {
  nb::class_<ImportOptions>(module, "ImportOptions",
                            "What is asked of import_tables(), as texts and numbers.")
      .def(nb::init<>())
      .def_rw("pressures", &ImportOptions::pressures)
      .def_rw("poses", &ImportOptions::poses)
      .def_rw("array", &ImportOptions::array)
      .def_rw("first_element", &ImportOptions::first_element)
      .def_rw("order", &ImportOptions::order)
      .def_rw("dead", &ImportOptions::dead)
      .def_rw("pressure_unit", &ImportOptions::pressure_unit)
      .def_rw("pose_unit", &ImportOptions::pose_unit)
      .def_rw("time_unit", &ImportOptions::time_unit)
      .def_rw("time_column", &ImportOptions::time_column)
      .def_rw("pressure_columns", &ImportOptions::pressure_columns)
      .def_rw("pose_columns", &ImportOptions::pose_columns)
      .def_rw("plane", &ImportOptions::plane)
      .def_rw("largest_gap_s", &ImportOptions::largest_gap_s)
      .def_rw("rate", &ImportOptions::rate_hz)
      .def_rw("rows", &ImportOptions::rows)
      .def_rw("object", &ImportOptions::object)
      .def_rw("unposed", &ImportOptions::unposed);
  module.def(
      "import_tables", &import_python, "options"_a, "elements_mm"_a = nb::none(),
      "The recording, and what is worth a warning. elements_mm [e, 2] stands for the array.");
}

}  // namespace palpate::python
