#pragma once

#include <vector>

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "palpate/touch.hpp"

namespace palpate::python {

bool is_touch(PyObject* object) noexcept;
bool is_recording(PyObject* object) noexcept;

// The classes of palpate._recording, whose arrays are NumPy's.
struct TouchObject : nb::object {
  NB_OBJECT_DEFAULT(TouchObject, nb::object, "palpate._recording.Touch", is_touch)
};
struct RecordingObject : nb::object {
  NB_OBJECT_DEFAULT(RecordingObject, nb::object, "palpate._recording.Recording", is_recording)
};
/// A Touch, a Recording, or an iterable of touches.
struct TouchesLike : nb::object {
  NB_OBJECT_DEFAULT(TouchesLike, nb::object,
                    "palpate._recording.Touch | palpate._recording.Recording | "
                    "collections.abc.Iterable[palpate._recording.Touch]",
                    any_object)
};

/// Views of touches, and the object that keeps their memory.
struct TouchViews {
  std::vector<Touch> touches;
  nb::object kept;
};
/// Throws Error where an item is no touch, or was given another shape in place.
TouchViews views_of(nb::handle touches);

/// A copy, which may be used without the GIL.
Recording recording_of(const RecordingObject& recording);
/// Takes over the recording's memory.
RecordingObject to_python(Recording recording);

}  // namespace palpate::python
