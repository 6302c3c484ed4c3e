#include <nanobind/nanobind.h>

#include "bindings.hpp"
#include "call.hpp"
#include "model/option_words.hpp"
#include "palpate/error.hpp"

namespace palpate::python {

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
