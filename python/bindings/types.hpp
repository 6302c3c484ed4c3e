#pragma once

#include <filesystem>

#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>

namespace palpate::python {

namespace nb = nanobind;

inline bool any_object(PyObject* object) { return object != nullptr; }
inline bool is_path(PyObject* object) {
  return PyUnicode_Check(object) || PyBytes_Check(object) ||
         PyObject_HasAttrString(object, "__fspath__") != 0;
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
struct CountArray : nb::object {
  NB_OBJECT_DEFAULT(CountArray, nb::object, "numpy.typing.NDArray[numpy.uint64]", any_object)
};
/// The path of a file. nanobind's own name of the type lacks an argument that strict checks ask
/// for.
struct PathLike : nb::object {
  NB_OBJECT_DEFAULT(PathLike, nb::object, "str | os.PathLike[str]", is_path)
  std::filesystem::path path() const { return nb::cast<std::filesystem::path>(*this); }
};
/// A DisplacementSd, which may be given as a tuple.
struct DisplacementSdLike : nb::object {
  NB_OBJECT_DEFAULT(DisplacementSdLike, nb::object, "DisplacementSd | tuple[float, float]",
                    any_object)
};
/// Called with the fraction done; null or None: nobody asks.
struct Progress : nb::object {
  NB_OBJECT_DEFAULT(Progress, nb::object, "collections.abc.Callable[[float], object]", any_object)
};

}  // namespace palpate::python
