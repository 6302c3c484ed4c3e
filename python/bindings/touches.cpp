#include "touches.hpp"

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate::python {

namespace {

/// Row i of an array [n, e...], where it has one more axis than `rank`; else all of it.
template <typename Value>
Array<Value> row(const Array<Value>& array, std::size_t rank, std::size_t i) {
  return array.shape.size() == rank ? array : in_place<Value>(array.object[i]);
}

template <typename Value>
std::span<const Value> bytes_row(const std::optional<Array<Value>>& array, std::size_t i,
                                 std::size_t elements) {
  if (!array) {
    return {};
  }
  return array->values().subspan(array->shape.size() == 1 ? 0 : i * elements, elements);
}

/// An array over a vector's memory, which it takes over.
template <typename Row, std::size_t rank>
auto taken(std::vector<Row> rows, const std::size_t (&shape)[rank]) {
  return in_place<NumberOf<Row>>(owned(std::move(rows), shape));
}

template <typename Value>
std::vector<Value> vector_of(const std::optional<Array<Value>>& array) {
  return array ? array->copied() : std::vector<Value>();
}

}  // namespace

Touch ArrayTouch::touch() const {
  return {.T_robot_sensor = as_poses(T_robot_sensor).front(),
          .elements_mm = as_points(elements_mm),
          .pressure = pressure.values(),
          .valid = valid ? valid->values() : std::span<const std::uint8_t>()};
}

void ArrayTouch::keep(std::vector<nb::object>& kept) const {
  kept.insert(kept.end(), {elements_mm.object, pressure.object});
  if (valid) {
    kept.push_back(valid->object);
  }
}

Touch ArrayRecording::touch(std::size_t i) const {
  const auto places = as_points(elements_mm);
  return {.T_robot_sensor = as_poses(T_robot_sensor)[i],
          .elements_mm =
              elements_mm.shape.size() == 2 ? places : places.subspan(i * elements(), elements()),
          .pressure = pressure.values().subspan(i * elements(), elements()),
          .valid = bytes_row(valid, i, elements())};
}

ArrayTouch ArrayRecording::array_touch(std::size_t i) const {
  return {.T_robot_sensor = row(T_robot_sensor, 1, i),
          .elements_mm = row(elements_mm, 2, i),
          .pressure = row(pressure, 1, i),
          .valid = valid ? std::optional(row(*valid, 1, i)) : std::nullopt};
}

std::vector<Touch> ArrayRecording::touches(std::size_t begin, std::size_t end) const {
  std::vector<Touch> touches;
  for (std::size_t i = begin; i < end; ++i) {
    touches.push_back(touch(i));
  }
  return touches;
}

void ArrayRecording::keep(std::vector<nb::object>& kept) const {
  kept.insert(kept.end(), {T_robot_sensor.object, pressure.object, elements_mm.object});
  if (valid) {
    kept.push_back(valid->object);
  }
}

Recording ArrayRecording::copied() const {
  const auto poses = as_poses(T_robot_sensor);
  const auto places = as_points(elements_mm);
  Recording copy = static_cast<const Recording&>(*this);
  copy.T_robot_sensor = {poses.begin(), poses.end()};
  copy.pressure = pressure.copied();
  copy.elements_mm = {places.begin(), places.end()};
  copy.valid = vector_of(valid);
  copy.time_s = vector_of(time_s);
  copy.baseline = vector_of(baseline);
  copy.device_time_s = vector_of(device_time_s);
  copy.lost_before = vector_of(lost_before);
  return copy;
}

ArrayRecording array_recording(Recording recording) {
  const std::size_t n = recording.size();
  const std::size_t e = recording.elements();
  const auto optional = [](auto& values, const auto&... shape) {
    using Value = typename std::decay_t<decltype(values)>::value_type;
    return values.empty() ? std::nullopt
                          : std::optional<Array<Value>>(taken(std::move(values), shape...));
  };
  const std::size_t frames[] = {n};
  const std::size_t array[] = {e};
  const std::size_t all[] = {n, e};
  ArrayRecording result;
  const bool moves = recording.elements_mm.size() != e;
  result.elements_mm = moves ? taken(std::move(recording.elements_mm), {n, e, 2})
                             : taken(std::move(recording.elements_mm), {e, 2});
  result.valid = recording.valid.size() > e ? optional(recording.valid, all)
                                            : optional(recording.valid, array);
  result.T_robot_sensor = taken(std::move(recording.T_robot_sensor), {n, 3});
  result.pressure = taken(std::move(recording.pressure), {n, e});
  result.time_s = optional(recording.time_s, frames);
  result.baseline = optional(recording.baseline, array);
  result.device_time_s = optional(recording.device_time_s, frames);
  result.lost_before = optional(recording.lost_before, frames);
  static_cast<Recording&>(result) = std::move(recording);
  return result;
}

TouchViews views_of(nb::handle touches) {
  TouchViews views;
  if (const ArrayTouch* touch = nullptr; nb::try_cast(touches, touch) && touch != nullptr) {
    views.touches.push_back(touch->touch());
    touch->keep(views.kept);
    return views;
  }
  if (const ArrayRecording* recording = nullptr;
      nb::try_cast(touches, recording) && recording != nullptr) {
    views.touches = recording->touches(0, recording->size());
    recording->keep(views.kept);
    return views;
  }
  const nb::object all = call("builtins", "list", touches);
  for (const nb::handle item : all) {
    const ArrayTouch* touch = nullptr;
    if (!nb::try_cast(item, touch) || touch == nullptr) {
      throw Error(Fault::input,
                  fmt::format("touches: item {} is a {}; give a Touch, a Recording or an iterable "
                              "of Touch",
                              views.touches.size(), nb::inst_name(item).c_str()));
    }
    views.touches.push_back(touch->touch());
    touch->keep(views.kept);
  }
  return views;
}

}  // namespace palpate::python
