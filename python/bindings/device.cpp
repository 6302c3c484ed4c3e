#include "palpate/device.hpp"

#include <memory>
#include <string>
#include <variant>

#include <fmt/format.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "call.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Name = std::variant<int, std::string>;

std::string device_name(const Name& name) {
  const int* index = std::get_if<int>(&name);
  return index != nullptr ? std::to_string(*index) : std::get<std::string>(name);
}

}  // namespace

void bind_device(nb::module_& module) {
  nb::class_<DeviceInfo>(module, "DeviceInfo", "A Vulkan device as `palpate devices` lists it.")
      .def_ro("index", &DeviceInfo::index, "Place in Vulkan's order.")
      .def_ro("name", &DeviceInfo::name, "As Vulkan reports it.")
      .def_ro("type", &DeviceInfo::type,
              "\"discrete\", \"integrated\", \"virtual\", \"CPU\" or \"other\".")
      .def_ro("driver", &DeviceInfo::driver, "Name and version of the driver.")
      .def_ro("api", &DeviceInfo::api, "Vulkan version, such as \"1.3.230\".")
      .def_ro("memory_gib", &DeviceInfo::memory_gib, "Size of its memory in GiB.")
      .def_ro("usable", &DeviceInfo::usable, "Palpate can compute on it.")
      .def_ro("chosen", &DeviceInfo::chosen, "Device.open() takes this device.")
      .def_ro("reason", &DeviceInfo::reason, "Why the device is chosen or refused.")
      .def("__repr__", &repr_of);

  nb::class_<Device>(
      module, "Device",
      "An open Vulkan device. The objects made on it keep it open. Threads may share it and them:\n"
      "one thread at a time uses an object, and the others wait without the GIL.")
      .def_static(
          "open",
          [](const Name& name) {
            return run([&] { return std::make_shared<Device>(Device::open(device_name(name))); });
          },
          "name_or_index"_a = "",
          "Opens a device by its index or a part of its name. By default the one that the\n"
          "environment variable PALPATE_DEVICE names, or else the best.\n\n"
          "Raises Error that names every device and why it is refused.")
      .def_static(
          "list",
          [](const Name& name) { return run([&] { return Device::list(device_name(name)); }); },
          "name_or_index"_a = "", "Every device, in Vulkan's order.")
      .def_prop_ro("name", &Device::name, "As Vulkan reports it.")
      .def_prop_ro("memory_bytes", &Device::memory_bytes,
                   "Size of the memory in which it computes; a CPU device shares the machine's.")
      .def("__repr__", [](const Device& self) {
        return fmt::format("Device('{}', {:.1f} GiB)", self.name(),
                           static_cast<double>(self.memory_bytes()) / (1 << 30));
      });
}

}  // namespace palpate::python
