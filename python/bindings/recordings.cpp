#include <filesystem>
#include <string>

#include <fmt/format.h>

#include "bindings.hpp"
#include "call.hpp"
#include "palpate/files.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

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
        const Recording copy = recording_of(recording);
        const std::filesystem::path path = file.path();
        run([&] { write_recording(path, copy); });
      },
      "path"_a, "recording"_a, "Writes a recording file (HDF5), whole or not at all.");
  module.def(
      "read_recording",
      [](const PathLike& file) {
        const std::filesystem::path path = file.path();
        return to_python(run([&] { return read_recording(path); }));
      },
      "path"_a,
      "Reads a recording file (HDF5); of an unclosed file, the whole rows. Raises Error naming\n"
      "file, field and remedy, also where a shape is larger than what is stored of it. A file "
      "that\n"
      "is damaged so that libhdf5 crashes or loops takes this process with it: check files of\n"
      "unknown origin with the command `palpate info FILE` first.");
}

}  // namespace palpate::python
