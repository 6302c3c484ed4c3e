#include "arrays.hpp"

#include <cctype>
#include <cstring>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "palpate/error.hpp"

namespace palpate::python {

namespace {

[[noreturn]] void refuse(const char* name, const std::string& message) {
  throw Error(Fault::input, fmt::format("{}: {}", name, message));
}

/// The array with its mask where some of its values are masked, or else a null object. A list may
/// hold masked rows or values.
nb::object masked_array(nb::handle object) {
  const nb::module_ ma = nb::module_::import_("numpy.ma");
  nb::object array = nb::borrow(object);
  if (nb::isinstance<nb::list>(object) || nb::isinstance<nb::tuple>(object)) {
    const nb::object masked = ma.attr("MaskedArray");
    bool any = false;
    for (const nb::handle item : object) {
      any = any || nb::isinstance(item, masked);
    }
    if (!any) {
      return {};
    }
    array = ma.attr("asarray")(object);
  }
  return nb::cast<bool>(ma.attr("is_masked")(array)) ? array : nb::object();
}

/// numpy.asarray(object); throws Error where it is no array of numbers of these kinds.
nb::object as_array(nb::handle object, const char* name, const char* kinds, const char* wanted) {
  nb::object array;
  try {
    array = call("numpy", "asarray", object);
  } catch (nb::python_error& error) {
    if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_TypeError)) {
      throw;
    }
    refuse(name, fmt::format("is no array of numbers; give {}", wanted));
  }
  const auto kind = nb::cast<std::string>(array.attr("dtype").attr("kind"));
  const bool empty = nb::cast<std::size_t>(array.attr("size")) == 0;
  if (!empty && std::strchr(kinds, kind[0]) == nullptr) {
    const nb::object dtype = array.attr("dtype");
    refuse(name, fmt::format("dtype {}; give {}", nb::str(dtype).c_str(), wanted));
  }
  return array;
}

/// The array itself, or a copy, with this dtype and C layout.
nb::object with_layout(const nb::object& array, const char* dtype) {
  return call("numpy", "asarray", array, nb::arg("dtype") = dtype, nb::arg("order") = "C");
}

void refuse_masked(nb::handle object, const char* name) {
  if (masked_array(object).is_valid()) {
    refuse(name, "has masked values, which only readings may have; give all of them");
  }
}

template <typename Shape>
std::string shape_text(const Shape& shape) {
  return fmt::format("({}{})", fmt::join(shape, ", "), shape.size() == 1 ? "," : "");
}

template <typename Row>
std::span<const Row> rows(const Floats& array) {
  return {reinterpret_cast<const Row*>(array.data), array.size() * sizeof(double) / sizeof(Row)};
}

}  // namespace

std::span<const Pose> as_poses(const Floats& array) { return rows<Pose>(array); }
std::span<const glm::dvec2> as_points(const Floats& array) { return rows<glm::dvec2>(array); }

template <typename Value>
Array<Value> in_place(nb::object array) {
  Py_buffer buffer{};
  if (PyObject_GetBuffer(array.ptr(), &buffer, PyBUF_C_CONTIGUOUS) != 0) {
    throw nb::python_error();
  }
  Array<Value> result{std::move(array),
                      static_cast<const Value*>(buffer.buf),
                      {buffer.shape, buffer.shape + buffer.ndim}};
  PyBuffer_Release(&buffer);  // the array keeps the memory
  return result;
}
template Floats in_place<double>(nb::object);
template Bytes in_place<std::uint8_t>(nb::object);
template Counts in_place<std::uint64_t>(nb::object);

template <typename Value>
Array<Value> ArrayReader::checked(const nb::object& array, const char* name, Shape shape,
                                  Shape longer) {
  Array<Value> result = in_place<Value>(array);
  if (longer.size() > 0 && result.shape.size() > shape.size()) {
    shape = longer;
  }
  bool fits = result.shape.size() == shape.size();
  std::string known;
  std::map<std::string, Extent> extents = extents_;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const std::string extent = shape.begin()[i];
    if (std::isdigit(static_cast<unsigned char>(extent[0])) != 0) {
      fits = fits && result.shape[i] == std::stoul(extent);
      continue;
    }
    if (const auto found = extents_.find(extent); found != extents_.end()) {
      known += fmt::format("{} {} = {} of {}", known.empty() ? " with" : " and", extent,
                           found->second.value, found->second.given_by);
    }
    if (fits) {
      const auto [entry, is_new] = extents.try_emplace(extent, Extent{result.shape[i], name});
      fits = is_new || entry->second.value == result.shape[i];
    }
  }
  if (!fits) {
    refuse(name,
           fmt::format("shape {}; give {}{}", shape_text(result.shape), shape_text(shape), known));
  }
  extents_ = std::move(extents);
  return result;
}

Floats ArrayReader::floats(nb::handle object, const char* name, Shape shape, Shape longer) {
  refuse_masked(object, name);
  return readings(object, name, shape, longer);
}

Floats ArrayReader::readings(nb::handle object, const char* name, Shape shape, Shape longer) {
  const nb::object array = as_array(object, name, "fiu", "numbers (float64)");
  return checked<double>(with_layout(array, "float64"), name, shape, longer);
}

std::optional<Bytes> ArrayReader::valid(nb::handle readings, const std::optional<ArrayLike>& valid,
                                        Shape shape) {
  const auto given = valid ? std::optional(flags(*valid, "valid", {"e"}, shape)) : std::nullopt;
  const nb::object masked = masked_array(readings);
  if (!masked.is_valid()) {
    return given;
  }
  const nb::object known = call("numpy", "logical_not", call("numpy.ma", "getmaskarray", masked));
  return flags(given ? call("numpy", "logical_and", given->object, known) : known, "valid", shape);
}

Bytes ArrayReader::flags(nb::handle object, const char* name, Shape shape, Shape longer,
                         const char* wanted) {
  refuse_masked(object, name);
  const nb::object array = as_array(object, name, "biu", wanted);
  const bool bytes = nb::cast<std::string>(array.attr("dtype").attr("name")) == "uint8";
  return checked<std::uint8_t>(with_layout(array, bytes ? "uint8" : "bool").attr("view")("uint8"),
                               name, shape, longer);
}

Counts ArrayReader::counts(nb::handle object, const char* name, Shape shape) {
  refuse_masked(object, name);
  const nb::object array = as_array(object, name, "iu", "whole numbers (uint64)");
  if (nb::cast<std::size_t>(array.attr("size")) > 0 && call("numpy", "min", array) < nb::int_(0)) {
    refuse(name, "has a count below 0; give whole numbers from 0");
  }
  return checked<std::uint64_t>(with_layout(array, "uint64"), name, shape);
}

Pose pose_of(nb::handle object, const char* name) {
  return as_poses(ArrayReader().floats(object, name, {"3"})).front();
}

glm::dvec2 point_of(nb::handle object, const char* name) {
  return as_points(ArrayReader().floats(object, name, {"2"})).front();
}

std::vector<Pose> poses_of(nb::handle object, const char* name) {
  const Floats array = ArrayReader().floats(object, name, {"n", "3"});
  const auto poses = as_poses(array);
  return {poses.begin(), poses.end()};
}

std::vector<glm::dvec2> points_of(nb::handle object, const char* name) {
  const Floats array = ArrayReader().floats(object, name, {"n", "2"});
  const auto points = as_points(array);
  return {points.begin(), points.end()};
}

}  // namespace palpate::python
