#include "arrays.hpp"

namespace palpate::python {

template <typename Value>
Array<Value> in_place(nb::object array) {
  Py_buffer buffer{};
  if (PyObject_GetBuffer(array.ptr(), &buffer, PyBUF_C_CONTIGUOUS) != 0) {
    throw nb::python_error();
  }
  const bool fits = buffer.itemsize == sizeof(Value);
  Array<Value> result{std::move(array),
                      static_cast<const Value*>(buffer.buf),
                      {buffer.shape, buffer.shape + buffer.ndim}};
  PyBuffer_Release(&buffer);  // the array keeps the memory
  if (!fits) {
    throw nb::type_error("an array of another dtype");
  }
  return result;
}
template Floats in_place<double>(nb::object);
template Bytes in_place<std::uint8_t>(nb::object);
template Array<std::uint64_t> in_place<std::uint64_t>(nb::object);

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
