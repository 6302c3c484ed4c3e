#pragma once

#include <optional>
#include <vector>

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "palpate/touch.hpp"

namespace palpate::python {

/// A touch whose arrays are NumPy's.
struct ArrayTouch {
  Floats T_robot_sensor;  ///< [3]
  Floats elements_mm;     ///< [e, 2]
  Floats pressure;        ///< [e]
  std::optional<Bytes> valid;

  Touch touch() const;
  /// Adds the objects that touch() depends on.
  void keep(std::vector<nb::object>& kept) const;
};

/// A recording whose arrays are NumPy's, in the place of Recording's own, which are empty.
struct ArrayRecording : Recording {
  Floats T_robot_sensor;  ///< [n, 3]
  Floats pressure;        ///< [n, e]
  Floats elements_mm;     ///< [e, 2] or [n, e, 2]
  std::optional<Bytes> valid;
  std::optional<Floats> time_s;
  std::optional<Floats> baseline;
  std::optional<Floats> device_time_s;
  std::optional<Counts> lost_before;

  std::size_t size() const { return pressure.shape[0]; }
  std::size_t elements() const { return pressure.shape[1]; }
  Touch touch(std::size_t i) const;
  ArrayTouch array_touch(std::size_t i) const;
  std::vector<Touch> touches(std::size_t begin, std::size_t end) const;
  void keep(std::vector<nb::object>& kept) const;
  /// A copy, for writing.
  Recording copied() const;
};

/// Takes over the recording's memory.
ArrayRecording array_recording(Recording recording);

/// A Touch, a Recording, or an iterable of touches. Named with their module, which
/// palpate.reference is not.
struct TouchesLike : nb::object {
  NB_OBJECT_DEFAULT(TouchesLike, nb::object,
                    "palpate._palpate.Touch | palpate._palpate.Recording | "
                    "collections.abc.Iterable[palpate._palpate.Touch]",
                    any_object)
};

/// Views of touches, and the objects whose memory they see.
struct TouchViews {
  std::vector<Touch> touches;
  std::vector<nb::object> kept;
};
TouchViews views_of(nb::handle touches);

}  // namespace palpate::python
