#include <memory>
#include <string>
#include <variant>

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "call.hpp"
#include "model/option_words.hpp"
#include "palpate/device.hpp"
#include "palpate/error.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

/// palpate.Error, with `fault` as in C++. Never freed: exceptions may come until the end.
PyObject* error_class = nullptr;

void add_error() {
  error_class = nb::object(nb::module_::import_("palpate._error").attr("Error")).release().ptr();
  nb::register_exception_translator(
      [](const std::exception_ptr& thrown, void*) {
        try {
          std::rethrow_exception(thrown);
        } catch (const Error& error) {
          const nb::object value = nb::borrow(error_class)(in_keywords(error.what()));
          value.attr("fault") = error.fault() == Fault::input ? "input" : "system";
          PyErr_SetObject(error_class, value.ptr());
        }
      },
      nullptr);
}

using Name = std::variant<int, std::string>;

std::string device_name(const Name& name) {
  const int* index = std::get_if<int>(&name);
  return index != nullptr ? std::to_string(*index) : std::get<std::string>(name);
}

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

}  // namespace

}  // namespace palpate::python

NB_MODULE(_palpate, module) {
  using namespace palpate::python;
  nb::set_leak_warnings(false);  // of what daemon threads hold at the end, or children of fork()
  module.doc() = "Bindings of libpalpate; import palpate instead.";
  add_error();
  await_calls_at_exit();
  bind_model(module);
  bind_maps(module);
  bind_touches(module);
  bind_device(module);
  bind_map_builder(module);
  bind_estimate(module);
  bind_filters(module);
  bind_simulation(module);
  bind_sensors(module);
  bind_request(module);
  bind_recognition(module);
  bind_batch(module);
  bind_learning(module);
  bind_import(module);
}
