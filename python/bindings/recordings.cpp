#include <fmt/format.h>
#include <nanobind/stl/optional.h>

#include "bindings.hpp"
#include "call.hpp"
#include "palpate/files.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

FloatArray object_of(const Floats& array) { return nb::borrow<FloatArray>(array.object); }
ByteArray object_of(const Bytes& array) { return nb::borrow<ByteArray>(array.object); }
CountArray object_of(const Counts& array) { return nb::borrow<CountArray>(array.object); }
template <typename Value>
auto object_of(const std::optional<Array<Value>>& array) {
  return array ? std::optional(object_of(*array)) : std::nullopt;
}

/// A property: the array that C++ reads, as Python gave it or as a copy; None where there is none.
template <typename Class, typename Member>
auto array_in(Member Class::*member) {
  return [member](const Class& self) { return object_of(self.*member); };
}

void bind_touch(nb::module_& module) {
  nb::class_<ArrayTouch>(
      module, "Touch",
      "One reading of the tactile array at a known pose. Its arrays are those that were given,\n"
      "where these are float64 with C layout: a change of them changes the touch.")
      .def(
          "__init__",
          [](ArrayTouch* self, const ArrayLike& T_robot_sensor, const ArrayLike& elements_mm,
             const ArrayLike& pressure, const std::optional<ArrayLike>& valid) {
            ArrayReader reader;
            ArrayTouch touch{
                .T_robot_sensor = reader.floats(T_robot_sensor, "T_robot_sensor", {"3"}),
                .elements_mm = reader.floats(elements_mm, "elements_mm", {"e", "2"}),
                .pressure = reader.readings(pressure, "pressure", {"e"}),
                .valid = reader.valid(pressure, valid, {"e"})};
            new (self) ArrayTouch(std::move(touch));
          },
          "T_robot_sensor"_a, "elements_mm"_a, "pressure"_a, "valid"_a = nb::none(),
          "T_robot_sensor [3] (x_mm, y_mm, theta_rad); elements_mm [e, 2], element centres in the\n"
          "sensor frame; pressure [e] in the recording's unit; valid [e], False for a dead "
          "element.\n"
          "\nRaises Error on other shapes.")
      .def_prop_ro("T_robot_sensor", array_in(&ArrayTouch::T_robot_sensor),
                   "[3] (x_mm, y_mm, theta_rad).")
      .def_prop_ro("elements_mm", array_in(&ArrayTouch::elements_mm),
                   "[e, 2], element centres in the sensor frame.")
      .def_prop_ro("pressure", array_in(&ArrayTouch::pressure), "[e] in the recording's unit.")
      .def_prop_ro("valid", array_in(&ArrayTouch::valid),
                   "[e], 0 for a dead element; None: all are alive.")
      .def("__repr__", [](const ArrayTouch& self) {
        return fmt::format("Touch({} elements at {})", self.pressure.size(),
                           text_of(as_poses(self.T_robot_sensor).front()));
      });
}

template <typename Value>
Array<Value> sliced(const Array<Value>& array, const nb::slice& slice) {
  // A step makes another layout, and so a copy.
  return in_place<Value>(call("numpy", "ascontiguousarray", array.object[slice]));
}

ArrayRecording sliced(const ArrayRecording& all, const nb::slice& slice) {
  ArrayRecording part = all;
  part.pressure = sliced(all.pressure, slice);
  part.T_robot_sensor = sliced(all.T_robot_sensor, slice);
  const auto cut = [&](auto& array, std::size_t constant_rank) {
    if (array && array->shape.size() > constant_rank) {
      array = sliced(*array, slice);
    }
  };
  if (all.elements_mm.shape.size() == 3) {
    part.elements_mm = sliced(all.elements_mm, slice);
  }
  cut(part.valid, 1);
  cut(part.time_s, 0);
  cut(part.device_time_s, 0);
  cut(part.lost_before, 0);
  return part;
}

nb::object item(const ArrayRecording& recording, nb::handle index) {
  if (nb::isinstance<nb::slice>(index)) {
    Py_ssize_t start = 0;
    Py_ssize_t stop = 0;
    Py_ssize_t step = 0;
    if (PySlice_Unpack(index.ptr(), &start, &stop, &step) != 0) {
      throw nb::python_error();
    }
    return nb::cast(sliced(recording, nb::slice(start, stop, step)));
  }
  if (PyIndex_Check(index.ptr()) == 0) {
    throw nb::type_error(
        fmt::format("index: is a {}; give a whole number or a slice", nb::inst_name(index).c_str())
            .c_str());
  }
  const auto n = static_cast<Py_ssize_t>(recording.size());
  const Py_ssize_t given = PyNumber_AsSsize_t(index.ptr(), PyExc_IndexError);
  if (given == -1 && PyErr_Occurred() != nullptr) {
    throw nb::python_error();
  }
  const Py_ssize_t i = given < 0 ? given + n : given;
  if (i < 0 || i >= n) {
    throw nb::index_error(fmt::format("touch {} of {}", given, n).c_str());
  }
  return nb::cast(recording.array_touch(static_cast<std::size_t>(i)));
}

void bind_recording(nb::module_& module) {
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
      .def("__repr__", [](const Truth& self) {
        return fmt::format("Truth('{}', {})", self.object, text_of(self.T_object_robot));
      });

  nb::class_<ArrayRecording>(
      module, "Recording",
      "A sequence of readings of one array pressed against one object. Its arrays are those that\n"
      "were given, where dtype and layout allow; recording[i] is a Touch, and recording[a:b] a\n"
      "Recording over the same memory.")
      .def(
          "__init__",
          [](ArrayRecording* self, const ArrayLike& pressure, const ArrayLike& poses,
             const ArrayLike& elements_mm, const std::optional<ArrayLike>& valid,
             const std::optional<ArrayLike>& time_s, const std::string& object,
             const std::string& pressure_unit, const std::string& rows,
             const std::optional<Truth>& truth, const std::string& sensor,
             const std::string& serial, const std::optional<ArrayLike>& baseline,
             const std::optional<ArrayLike>& device_time_s,
             const std::optional<ArrayLike>& lost_before) {
            ArrayReader reader;
            ArrayRecording made;
            made.object = object;
            made.pressure_unit = pressure_unit;
            made.rows = rows;
            made.truth = truth;
            made.sensor = sensor;
            made.serial = serial;
            made.pressure = reader.readings(pressure, "pressure", {"n", "e"});
            made.T_robot_sensor = reader.floats(poses, "poses", {"n", "3"});
            made.elements_mm =
                reader.floats(elements_mm, "elements_mm", {"e", "2"}, {"n", "e", "2"});
            made.valid = reader.valid(pressure, valid, {"n", "e"});
            const auto floats = [&](const std::optional<ArrayLike>& array, const char* name,
                                    const char* letter) {
              return array ? std::optional(reader.floats(*array, name, {letter})) : std::nullopt;
            };
            made.time_s = floats(time_s, "time_s", "n");
            made.baseline = floats(baseline, "baseline", "e");
            made.device_time_s = floats(device_time_s, "device_time_s", "n");
            if (lost_before) {
              made.lost_before = reader.counts(*lost_before, "lost_before", {"n"});
            }
            new (self) ArrayRecording(std::move(made));
          },
          "pressure"_a, "poses"_a, "elements_mm"_a, nb::kw_only(), "valid"_a = nb::none(),
          "time_s"_a = nb::none(), "object"_a = "", "pressure_unit"_a = "kPa", "rows"_a = "touches",
          "truth"_a = nb::none(), "sensor"_a = "", "serial"_a = "", "baseline"_a = nb::none(),
          "device_time_s"_a = nb::none(), "lost_before"_a = nb::none(),
          "pressure [n, e] in pressure_unit, \"kPa\" or \"raw\"; poses T_robot_sensor [n, 3]\n"
          "(x_mm, y_mm, theta_rad); elements_mm [e, 2] in the sensor frame, or [n, e, 2] where\n"
          "the array changes; valid [e] or [n, e], False for a dead element; time_s [n] since the\n"
          "Unix epoch; object: its label, \"\" where unknown; rows: \"touches\", or \"frames\" of\n"
          "a raw stream, in which poses and pressures may be NaN (unknown).\n\n"
          "Raises Error naming the argument whose shape does not fit.")
      .def_prop_ro("pressure", array_in(&ArrayRecording::pressure), "[n, e] in pressure_unit.")
      .def_prop_ro("T_robot_sensor", array_in(&ArrayRecording::T_robot_sensor),
                   "[n, 3] (x_mm, y_mm, theta_rad).")
      .def_prop_ro(
          "elements_mm", array_in(&ArrayRecording::elements_mm),
          "Element centres in the sensor frame, [e, 2], or [n, e, 2] where the array changes.")
      .def_prop_ro("valid", array_in(&ArrayRecording::valid),
                   "[e] or [n, e], 0 for a dead element; None: all are alive.")
      .def_prop_ro("time_s", array_in(&ArrayRecording::time_s),
                   "[n] since the Unix epoch, or None.")
      .def_prop_ro("baseline", array_in(&ArrayRecording::baseline),
                   "[e] untouched readings, or None.")
      .def_prop_ro("device_time_s", array_in(&ArrayRecording::device_time_s),
                   "[n] by the sensor's own clock, or None.")
      .def_prop_ro("lost_before", array_in(&ArrayRecording::lost_before),
                   "[n] frames lost since the last row, or None.")
      .def_ro("path", &ArrayRecording::path, "The file that it was read from, or \"\".")
      .def_rw("object", &ArrayRecording::object, "Label of the object; \"\" where it is unknown.")
      .def_ro("pressure_unit", &ArrayRecording::pressure_unit, "\"kPa\" or \"raw\".")
      .def_ro("rows", &ArrayRecording::rows, "\"touches\", or \"frames\" of a raw stream.")
      .def_rw("truth", &ArrayRecording::truth, nb::arg("truth").none(),
              "The true identity and pose of an unknown object, or None.")
      .def_ro("sensor", &ArrayRecording::sensor, "Name of the sensor, or \"\".")
      .def_ro("serial", &ArrayRecording::serial, "Serial number of the sensor, or \"\".")
      .def_ro("closed", &ArrayRecording::closed, "False: cut off, or being recorded.")
      .def("__len__", &ArrayRecording::size)
      .def(
          "__iter__",
          [](nb::handle_t<ArrayRecording> self) { return nb::steal(PySeqIter_New(self.ptr())); },
          nb::sig("def __iter__(self) -> collections.abc.Iterator[Touch]"))
      .def("__getitem__", &item, "index"_a,
           nb::sig("@overload\ndef __getitem__(self, index: int) -> Touch: ...\n"
                   "@overload\ndef __getitem__(self, index: slice) -> Recording"))
      .def(
          "save",
          [](const ArrayRecording& self, const PathLike& file) {
            const Recording copy = self.copied();
            const std::filesystem::path path = file.path();
            run([&] { write_recording(path, copy); });
          },
          "path"_a,
          "Writes a recording file (HDF5), whole or not at all. Raises Error where the content is "
          "not sound\nor the file cannot be written.")
      .def(
          "plot", plot_method, "ax"_a = nb::none(), plot_signature,
          "Draws every reading at its element's place in the robot frame, in mm, with Matplotlib.\n"
          "Returns the axes.")
      .def("__repr__", [](const ArrayRecording& self) {
        return fmt::format("Recording({} {} of {} elements in {}{})", self.size(), self.rows,
                           self.elements(), self.pressure_unit,
                           self.object.empty() ? "" : ", of '" + self.object + "'");
      });
  module.def(
      "read_recording",
      [](const PathLike& file) {
        const std::filesystem::path path = file.path();
        return array_recording(run([&] { return read_recording(path); }));
      },
      "path"_a,
      "Reads a recording file (HDF5); of an unclosed file, the whole rows. Raises Error naming\n"
      "file, field and remedy, also where a shape is larger than what is stored of it. A file "
      "that\n"
      "is damaged so that libhdf5 crashes or loops takes this process with it: check files of\n"
      "unknown origin with the command `palpate info FILE` first.");
}

}  // namespace

void bind_touches(nb::module_& module) {
  bind_touch(module);
  bind_recording(module);
}

}  // namespace palpate::python
