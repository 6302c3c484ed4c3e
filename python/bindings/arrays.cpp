#include "arrays.hpp"

#include <string_view>

#include <fmt/format.h>

namespace palpate::python {

namespace {

/// The letters that Python's struct has for items of an array of these values.
template <typename Value>
constexpr std::string_view letters = "d";
template <>
constexpr std::string_view letters<std::uint8_t> = "B?";
template <>
constexpr std::string_view letters<std::uint64_t> = "LQ";

/// @param format a letter behind "@" or "=", which native numbers may have
template <typename Value>
bool is_of(std::string_view format) {
  format.remove_prefix(format.starts_with('@') || format.starts_with('=') ? 1 : 0);
  return format.size() == 1 && letters<Value>.find(format.front()) != std::string_view::npos;
}

}  // namespace

template <typename Value>
Array<Value> in_place(nb::object array, const char* name) {
  Py_buffer buffer{};
  if (PyObject_GetBuffer(array.ptr(), &buffer, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0) {
    throw nb::python_error();
  }
  const bool fits = buffer.itemsize == sizeof(Value) && is_of<Value>(buffer.format);
  Array<Value> result{std::move(array),
                      static_cast<const Value*>(buffer.buf),
                      {buffer.shape, buffer.shape + buffer.ndim}};
  PyBuffer_Release(&buffer);  // the array keeps the memory
  if (!fits) {
    throw nb::type_error(fmt::format("{}: was given another dtype", name).c_str());
  }
  return result;
}
template Floats in_place<double>(nb::object, const char*);
template Bytes in_place<std::uint8_t>(nb::object, const char*);
template Array<std::uint64_t> in_place<std::uint64_t>(nb::object, const char*);

Pose pose_of(nb::handle given, const char* name) {
  return ArrayReader().floats(given, name, {"3"}).copied<Pose>().front();
}

glm::dvec2 point_of(nb::handle given, const char* name) {
  return ArrayReader().floats(given, name, {"2"}).copied<glm::dvec2>().front();
}

std::vector<Pose> poses_of(nb::handle given, const char* name) {
  return ArrayReader().floats(given, name, {"n", "3"}).copied<Pose>();
}

std::vector<glm::dvec2> points_of(nb::handle given, const char* name) {
  return ArrayReader().floats(given, name, {"n", "2"}).copied<glm::dvec2>();
}

}  // namespace palpate::python
