#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "call.hpp"
#include "io/recording_rules.hpp"
#include "model/option_words.hpp"
#include "streaming/import_steps.hpp"
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
  if (!imported.assumed_units.empty()) {
    remarks.push_back(fmt::format("{}: {}; give pose_unit", options.poses, imported.assumed_units));
  }
  for (const std::string& words : imported.understood) {
    remarks.push_back(in_keywords(words));
  }
  for (const SetupFinding& finding : imported.recording.findings) {
    remarks.push_back(fmt::format("{}: {}", options.poses, in_keywords(finding.words)));
  }
  if (imported.whole_up_to) {
    remarks.push_back(
        fmt::format("{}: its readings are whole numbers up to {:.0f}: give "
                    "pressure_unit='raw' where they are not kPa",
                    options.pressures, *imported.whole_up_to));
  }
  return remarks;
}

using Imported = std::tuple<RecordingObject, std::vector<std::string>>;

Imported returned(ImportedRecording imported, const ImportOptions& options) {
  std::vector<std::string> remarks = remarks_on(imported, options);
  return {to_python(std::move(imported.recording)), std::move(remarks)};
}

Imported import_tables_python(const ImportOptions& options) {
  return returned(run([&] { return import_tables(options); }), options);
}

/// Readings [n, e], or of a grid [n, rows, columns]; of one that is read column by column [n,
/// columns, rows].
Floats readings_of(ArrayReader& reader, const ArrayLike& given, const ImportOptions& options) {
  if (nb::cast<int>(call("numpy", "ndim", given)) != 3) {
    return reader.known(given, "pressures", {"n", "e"});
  }
  const auto grid = run([&] { return grid_size(options); });
  const std::string columns = grid ? std::to_string((*grid)[0]) : "columns";
  const std::string rows = grid ? std::to_string((*grid)[1]) : "rows";
  const auto& [outer, inner] =
      options.order == "columns" ? std::tie(columns, rows) : std::tie(rows, columns);
  Floats readings = reader.known(given, "pressures", {"n", outer.c_str(), inner.c_str()});
  readings.shape = {readings.shape[0], readings.shape[1] * readings.shape[2]};
  return readings;
}

/// Refuses what is no time in s, and notes where the times step back, as of a table.
std::vector<ClockStep> steps_in(const std::vector<double>& time_s, const char* name) {
  std::vector<ClockStep> steps;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    if (!(std::abs(time_s[i]) <= latest_time_s)) {
      refuse(fmt::format("{}[{}]", name, i), "{} is no time; give seconds", time_s[i]);
    }
    if (i > 0 && time_s[i] < time_s[i - 1]) {
      steps.push_back({i, i, time_s[i - 1], time_s[i]});
    }
  }
  return steps;
}

/// Gives poses their times; of one time the first is kept.
void keep_first_of_times(const std::vector<double>& time_s, PoseTable& poses) {
  std::vector<std::optional<SpatialPose>> kept;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    if (poses.time_s.empty() || time_s[i] != poses.time_s.back()) {
      poses.time_s.push_back(time_s[i]);
      kept.push_back(poses.spatial[i]);
    }
  }
  if (const std::size_t repeated = time_s.size() - kept.size(); repeated > 0) {
    poses.understood.push_back(fmt::format(
        "{} of its rows repeat the time of the row before, whose pose is kept", repeated));
  }
  poses.spatial = std::move(kept);
  poses.steps = steps_in(poses.time_s, "pose_time_s");
}

Imported import_frames(const ImportOptions& options, const ArrayLike& pressures,
                       const std::optional<ArrayLike>& time_s, const ArrayLike& pose_time_s,
                       const std::optional<ArrayLike>& poses,
                       const std::optional<ArrayLike>& object_pose) {
  ArrayReader reader;
  ImportRows rows;
  const Floats readings = readings_of(reader, pressures, options);
  rows.elements = readings.shape[1];
  rows.pressures.pressure = readings.copied();
  if (time_s) {
    rows.pressures.time_s = reader.floats(*time_s, "time_s", {"n"}).copied();
    rows.pressures.steps = steps_in(rows.pressures.time_s, "time_s");
  }
  if (poses) {
    const Floats all = reader.floats(*poses, "poses", {"m", "3|6|7|12|16"});
    rows.poses = poses_of_rows(options.poses, all.values(), all.shape[1], options);
    if (nb::cast<int>(call("numpy", "size", pose_time_s)) > 0) {
      keep_first_of_times(reader.floats(pose_time_s, "pose_time_s", {"m"}).copied(), *rows.poses);
    }
  }
  if (object_pose) {
    const Floats row = reader.floats(*object_pose, "object_pose", {"7"});
    rows.T_robot_object = poses_of_rows("object_pose", row.values(), 7, {}).spatial.front();
  }
  return returned(run([&] { return import_rows(options, std::move(rows)); }), options);
}

}  // namespace

void bind_import(nb::module_& module) {
  nb::class_<ImportOptions>(module, "ImportOptions",
                            "What is asked of import_tables(), as texts and numbers.")
      .def(nb::init<>())
      .def_rw("pressures", &ImportOptions::pressures)
      .def_rw("poses", &ImportOptions::poses)
      .def_rw("array", &ImportOptions::array)
      .def_prop_rw(
          "elements_mm",
          [](const ImportOptions& self) { return to_array(self.elements_mm.value()); },
          [](ImportOptions& self, const ArrayLike& elements_mm) {
            self.elements_mm = points_of(elements_mm, "array");
          },
          "[e, 2], in the place of the array.")
      .def_rw("first_element", &ImportOptions::first_element)
      .def_rw("order", &ImportOptions::order)
      .def_rw("dead", &ImportOptions::dead)
      .def_rw("pressure_unit", &ImportOptions::pressure_unit)
      .def_rw("sign", &ImportOptions::sign)
      .def_rw("pose_unit", &ImportOptions::pose_unit)
      .def_rw("time_unit", &ImportOptions::time_unit)
      .def_rw("time_column", &ImportOptions::time_column)
      .def_rw("header_line", &ImportOptions::header_line)
      .def_rw("where", &ImportOptions::where)
      .def_rw("pressure_columns", &ImportOptions::pressure_columns)
      .def_rw("pressure_component", &ImportOptions::pressure_component)
      .def_rw("pose_columns", &ImportOptions::pose_columns)
      .def_rw("euler", &ImportOptions::euler)
      .def_rw("matrix", &ImportOptions::matrix)
      .def_rw("mount", &ImportOptions::mount)
      .def_rw("plane", &ImportOptions::plane)
      .def_rw("largest_gap_s", &ImportOptions::largest_gap_s)
      .def_rw("pose_delay", &ImportOptions::pose_delay_s)
      .def_rw("rate", &ImportOptions::rate_hz)
      .def_rw("rows", &ImportOptions::rows)
      .def_rw("object", &ImportOptions::object)
      .def_rw("unposed", &ImportOptions::unposed);
  module.def("import_tables", &import_tables_python, "options"_a,
             "The recording, and what is worth a warning.");
  module.def("require_sound",
             nb::overload_cast<const ImportOptions&, std::size_t>(&palpate::require_sound),
             "options"_a, "pose_numbers"_a = 0,
             "Raises Error where import_frames() would refuse the options, the array, or poses of "
             "so many\n"
             "numbers, which 0 leaves out.");
  module.def(
      "import_frames", &import_frames, "options"_a, "pressures"_a, "time_s"_a.none(),
      "pose_time_s"_a, "poses"_a = nb::none(), "object_pose"_a = nb::none(),
      "As import_tables() of frames [n, e] at times [n], or of touches, and of poses of the\n"
      "sensor [m, k] in the robot frame, as tables have them, at times [m], or one for each frame\n"
      "where there are no times; and of an object's pose [7], mm and a quaternion x, y, z, w.");
}

}  // namespace palpate::python
