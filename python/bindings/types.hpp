#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include <nanobind/nanobind.h>

namespace nanobind::detail {

/// Text as UTF-8, in the place of nanobind's own caster, which refuses all else. Names of files
/// need not be UTF-8: in Python, a byte that is none is a lone surrogate, as in os.fsdecode().
template <>
struct type_caster<std::string> {
  NB_TYPE_CASTER(std::string, const_name("str"))

  bool from_python(handle source, std::uint8_t /*flags*/, cleanup_list* /*cleanup*/) noexcept {
    if (!PyUnicode_Check(source.ptr())) {
      return false;
    }
    const object bytes = steal(PyUnicode_AsEncodedString(source.ptr(), "utf-8", "surrogateescape"));
    if (!bytes.is_valid()) {
      PyErr_Clear();
      return false;
    }
    value.assign(PyBytes_AS_STRING(bytes.ptr()),
                 static_cast<std::size_t>(PyBytes_GET_SIZE(bytes.ptr())));
    return true;
  }
  static handle from_cpp(const std::string& text, rv_policy /*policy*/,
                         cleanup_list* /*cleanup*/) noexcept {
    return PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()),
                                "surrogateescape");
  }
};

}  // namespace nanobind::detail

namespace palpate::python {

namespace nb = nanobind;

/// Calls a function of a module of Python.
template <typename... Arguments>
nb::object call(const char* module, const char* function, Arguments&&... arguments) {
  return nb::module_::import_(module).attr(function)(std::forward<Arguments>(arguments)...);
}

// Methods that are implemented in Python.

inline nb::object plot_method(nb::handle self, nb::handle ax) {
  return call("palpate.plots", "plot", self, ax);
}
inline nb::object png_method(nb::handle self) { return call("palpate.plots", "png", self); }
/// Class(name=value, ...), by the properties.
inline nb::str repr_of(nb::handle self) {
  return nb::str(call("palpate.results", "text_of", self));
}
inline const nb::sig plot_signature(
    "def plot(self, ax: matplotlib.axes.Axes | None = None) -> matplotlib.axes.Axes");
inline const nb::sig png_signature("def _repr_png_(self) -> bytes | None");

inline bool any_object(PyObject* object) { return object != nullptr; }
inline bool is_path(PyObject* object) {
  return PyUnicode_Check(object) || PyBytes_Check(object) ||
         PyObject_HasAttrString(object, "__fspath__") != 0;
}
inline bool is_callable_or_none(PyObject* object) {
  return object == Py_None || PyCallable_Check(object) != 0;
}

// Arguments and results whose types the stubs name, and which C++ takes as plain objects.

struct ArrayLike : nb::object {
  NB_OBJECT_DEFAULT(ArrayLike, nb::object, "numpy.typing.ArrayLike", any_object)
};
struct FloatArray : nb::object {
  NB_OBJECT_DEFAULT(FloatArray, nb::object, "numpy.typing.NDArray[numpy.float64]", any_object)
};
struct ByteArray : nb::object {
  NB_OBJECT_DEFAULT(ByteArray, nb::object, "numpy.typing.NDArray[numpy.uint8]", any_object)
};
/// The path of a file.
struct PathLike : nb::object {
  NB_OBJECT_DEFAULT(PathLike, nb::object, "str | bytes | os.PathLike[str] | os.PathLike[bytes]",
                    is_path)
  /// The path's bytes. Throws what __fspath__ raises, and ValueError where the path holds a null.
  std::string text() const {
    PyObject* converted = nullptr;
    if (PyUnicode_FSConverter(m_ptr, &converted) == 0) {
      throw nb::python_error();
    }
    const nb::object bytes = nb::steal(converted);
    return {PyBytes_AS_STRING(converted), static_cast<std::size_t>(PyBytes_GET_SIZE(converted))};
  }
  std::filesystem::path path() const { return text(); }
};
/// A DisplacementSd, which may be given as a tuple.
struct DisplacementSdLike : nb::object {
  NB_OBJECT_DEFAULT(DisplacementSdLike, nb::object, "DisplacementSd | tuple[float, float]",
                    any_object)
};
/// The object as C++ has it. Throws TypeError with the message where it is none.
template <typename Value>
Value value_of(nb::handle object, const std::string& message) {
  Value value;
  if (!nb::try_cast(object, value)) {
    throw nb::type_error(message.c_str());
  }
  return value;
}
/// Called with the fraction done; null or None: nobody asks.
struct Progress : nb::object {
  NB_OBJECT_DEFAULT(Progress, nb::object, "collections.abc.Callable[[float], object]",
                    is_callable_or_none)
};

}  // namespace palpate::python
