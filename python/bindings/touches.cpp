#include "touches.hpp"

#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "call.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

constexpr const char* classes = "palpate._recording";

/// False also where Python cannot tell, as of a weakref.proxy to an object that is gone.
bool is_a(PyObject* object, const char* name) noexcept {
  try {
    return nb::isinstance(object, nb::module_::import_(classes).attr(name));
  } catch (const nb::python_error&) {
    return false;
  }
}

using Extent = std::vector<std::size_t>;

Error other_shape(nb::handle of, const char* name) {
  return Error(Fault::input, fmt::format("{}: was given another shape; make another {}", name,
                                         is_recording(of.ptr()) ? "Recording" : "Touch"));
}

/// The numbers of touches and of elements. Users can change the shape of an array in place: that of
/// the pressure is trusted, and others are checked by it at every use.
struct Extents {
  explicit Extents(nb::handle of) {
    const Extent shape = in_place<double>(of.attr("pressure"), "pressure").shape;
    const bool has_rows = is_recording(of.ptr());
    if (shape.size() != (has_rows ? 2 : 1)) {
      throw other_shape(of, "pressure");
    }
    n = has_rows ? shape.front() : 1;
    e = shape.back();
  }

  std::size_t n = 0;
  std::size_t e = 0;
};

/// An attribute's array, which has this shape or n times; none for None.
template <typename Value>
std::optional<Array<Value>> array_in(nb::handle of, const char* name, std::size_t n,
                                     const Extent& row) {
  nb::object given = of.attr(name);
  if (given.is_none()) {
    return std::nullopt;
  }
  Array<Value> array = in_place<Value>(std::move(given), name);
  Extent rows = row;
  rows.insert(rows.begin(), n);
  if (array.shape != row && array.shape != rows) {
    throw other_shape(of, name);
  }
  return array;
}

template <typename Value>
Value value_in(nb::handle of, const char* name) {
  return value_of<Value>(of.attr(name), fmt::format("{}: a value of another type", name));
}

template <typename Row>
std::vector<Row> copied(nb::handle of, const char* name, std::size_t n, const Extent& row) {
  const auto array = array_in<NumberOf<Row>>(of, name, n, row);
  return array ? array->template copied<Row>() : std::vector<Row>();
}

/// Views of [n] rows of an attribute's array, each of this shape; of an array of one row, the same
/// for all.
template <typename Row>
auto rows_of(nb::handle of, const char* name, std::size_t n, const Extent& row) {
  const auto array = array_in<NumberOf<Row>>(of, name, n, row);
  const std::span<const Row> all = array ? array->template rows<Row>() : std::span<const Row>();
  const std::size_t each = std::is_same_v<Row, Pose> ? 1 : row.front();
  return
      [all, each](std::size_t i) { return all.size() <= each ? all : all.subspan(i * each, each); };
}

/// The touches of a Touch or a Recording, whose arrays the object keeps.
void add_touches(nb::handle of, std::vector<Touch>& touches) {
  const auto [n, e] = Extents(of);
  const auto pose = rows_of<Pose>(of, "T_robot_sensor", n, {3});
  const auto elements_mm = rows_of<glm::dvec2>(of, "elements_mm", n, {e, 2});
  const auto pressure = rows_of<double>(of, "pressure", n, {e});
  const auto valid = rows_of<std::uint8_t>(of, "valid", n, {e});
  for (std::size_t i = 0; i < n; ++i) {
    touches.push_back({pose(i).front(), elements_mm(i), pressure(i), valid(i)});
  }
}

/// The vector's memory as an array, or None where it is empty.
template <typename Row, std::size_t rank>
nb::object array_or_none(std::vector<Row>& rows, const std::size_t (&shape)[rank]) {
  return rows.empty() ? nb::none() : nb::object(owned(std::move(rows), shape));
}

}  // namespace

bool is_touch(PyObject* object) noexcept { return is_a(object, "Touch"); }
bool is_recording(PyObject* object) noexcept { return is_a(object, "Recording"); }

TouchViews views_of(nb::handle touches) {
  TouchViews views{.touches = {}, .kept = nb::borrow(touches)};
  if (is_recording(touches.ptr())) {
    add_touches(touches, views.touches);
    return views;
  }
  // A list of its own, which the progress cannot change.
  views.kept = call("builtins", "list",
                    is_touch(touches.ptr()) ? nb::make_tuple(touches) : nb::borrow(touches));
  for (const nb::handle item : views.kept) {
    if (!is_touch(item.ptr())) {
      throw Error(Fault::input,
                  fmt::format("touches: item {} is a {}; give a Touch, a Recording or an iterable "
                              "of Touch",
                              views.touches.size(), nb::inst_name(item).c_str()));
    }
    add_touches(item, views.touches);
  }
  return views;
}

Recording recording_of(const RecordingObject& given) {
  const auto [n, e] = Extents(given);
  return {.path = value_in<std::string>(given, "path"),
          .object = value_in<std::string>(given, "object"),
          .pressure_unit = value_in<std::string>(given, "pressure_unit"),
          .rows = value_in<std::string>(given, "rows"),
          .T_robot_sensor = copied<Pose>(given, "T_robot_sensor", n, {3}),
          .pressure = copied<double>(given, "pressure", n, {e}),
          .elements_mm = copied<glm::dvec2>(given, "elements_mm", n, {e, 2}),
          .valid = copied<std::uint8_t>(given, "valid", n, {e}),
          .time_s = copied<double>(given, "time_s", n, {}),
          .truth = value_in<std::optional<Truth>>(given, "truth"),
          .findings = value_in<std::vector<SetupFinding>>(given, "_findings"),
          .sensor = value_in<std::string>(given, "sensor"),
          .serial = value_in<std::string>(given, "serial"),
          .baseline = copied<double>(given, "baseline", n, {e}),
          .device_time_s = copied<double>(given, "device_time_s", n, {}),
          .lost_before = copied<std::uint64_t>(given, "lost_before", n, {}),
          .closed = value_in<bool>(given, "closed")};
}

RecordingObject to_python(Recording recording) {
  const std::size_t n = recording.size();
  const std::size_t e = recording.elements();
  const bool moves = recording.elements_mm.size() != e;
  const bool flags_each = recording.valid.size() > e;
  nb::dict fields;
  fields["elements_mm"] = moves ? nb::object(owned(std::move(recording.elements_mm), {n, e, 2}))
                                : nb::object(owned(std::move(recording.elements_mm), {e, 2}));
  fields["valid"] =
      flags_each ? array_or_none(recording.valid, {n, e}) : array_or_none(recording.valid, {e});
  fields["T_robot_sensor"] = owned(std::move(recording.T_robot_sensor), {n, 3});
  fields["pressure"] = owned(std::move(recording.pressure), {n, e});
  fields["time_s"] = array_or_none(recording.time_s, {n});
  fields["baseline"] = array_or_none(recording.baseline, {e});
  fields["device_time_s"] = array_or_none(recording.device_time_s, {n});
  fields["lost_before"] = array_or_none(recording.lost_before, {n});
  fields["path"] = recording.path;
  fields["object"] = recording.object;
  fields["pressure_unit"] = recording.pressure_unit;
  fields["rows"] = recording.rows;
  fields["truth"] = recording.truth;
  fields["sensor"] = recording.sensor;
  fields["serial"] = recording.serial;
  fields["closed"] = recording.closed;
  fields["_findings"] = recording.findings;
  return nb::borrow<RecordingObject>(
      nb::module_::import_(classes).attr("Recording").attr("_of")(fields));
}

void bind_touches(nb::module_& module) {
  nb::class_<SetupFinding>(module, "SetupFinding", "What a recording's logs showed.");
  nb::class_<Truth>(module, "Truth", "The true identity and pose of an unknown object.")
      .def(
          "__init__",
          [](Truth* self, const std::string& object, const ArrayLike& T_object_robot) {
            new (self) Truth{object, pose_of(T_object_robot, "T_object_robot")};
          },
          "object"_a, "T_object_robot"_a, "T_object_robot [3] (x_mm, y_mm, theta_rad).")
      .def_ro("object", &Truth::object, "The label of the object.")
      .def_prop_ro("T_object_robot", array_of(&Truth::T_object_robot),
                   "[3] (x_mm, y_mm, theta_rad).")
      .def("__repr__", &repr_of);
  module.def(
      "write_recording",
      [](const PathLike& file, const RecordingObject& recording) {
        run([path = file.path(), copy = recording_of(recording)] { write_recording(path, copy); });
      },
      "path"_a, "recording"_a, "Writes a recording file (HDF5), whole or not at all.");
  module.def(
      "read_recording",
      [](const PathLike& file) {
        return to_python(run([path = file.path()] { return read_recording(path); }));
      },
      "path"_a,
      "Reads a recording file (HDF5); of an unclosed file, the whole rows. Raises Error naming\n"
      "file, field and remedy, also where a shape is larger than what is stored of it. A file "
      "that\n"
      "is damaged so that libhdf5 crashes or loops takes this process with it: check files of\n"
      "unknown origin with the command `palpate info FILE` first.");
}

}  // namespace palpate::python
