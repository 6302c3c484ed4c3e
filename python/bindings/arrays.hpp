#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <numeric>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/ndarray.h>
#include <glm/vec2.hpp>

#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"
#include "types.hpp"

namespace palpate::python {

static_assert(sizeof(Pose) == 3 * sizeof(double) && sizeof(glm::dvec2) == 2 * sizeof(double),
              "poses and points are rows of arrays of float64");

/// A NumPy array with C layout, whose memory C++ reads in place.
template <typename Value>
struct Array {
  nb::object object;  ///< keeps the memory alive
  const Value* data = nullptr;
  std::vector<std::size_t> shape = {0};

  std::size_t size() const {
    return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies());
  }
  std::span<const Value> values() const& { return rows<Value>(); }
  /// Poses [n, 3] as rows of x_mm, y_mm and theta_rad, and points [n, 2] in mm.
  template <typename Row>
  std::span<const Row> rows() const& {
    return {reinterpret_cast<const Row*>(data), size() * sizeof(Value) / sizeof(Row)};
  }
  // The memory goes with the array.
  std::span<const Value> values() const&& = delete;
  template <typename Row>
  std::span<const Row> rows() const&& = delete;

  template <typename Row = Value>
  std::vector<Row> copied() const {
    const auto all = rows<Row>();
    return {all.begin(), all.end()};
  }
};
using Floats = Array<double>;
using Bytes = Array<std::uint8_t>;

/// Reads the array in place. Throws TypeError where it is of other values, which may have been made
/// so in place, or its layout is not C's.
template <typename Value>
Array<Value> in_place(nb::object array, const char* name) {
  nb::ndarray<const Value, nb::c_contig, nb::device::cpu> read;
  if (!nb::try_cast(array, read, /*convert=*/false)) {
    throw nb::type_error(fmt::format("{}: was given another dtype or layout", name).c_str());
  }
  std::vector<std::size_t> shape;
  for (std::size_t axis = 0; axis < read.ndim(); ++axis) {
    shape.push_back(read.shape(axis));
  }
  return {std::move(array), read.data(), std::move(shape)};  // the array keeps the memory
}

/// Takes the arrays of one call, whose extents have to agree: palpate._arrays.Reader in C++.
class ArrayReader {
 public:
  using Shape = std::initializer_list<const char*>;

  Floats floats(nb::handle given, const char* name, Shape shape) {
    return in_place<double>(read("floats", given, name, shape), name);
  }
  /// Readings, NaN where they are masked.
  Floats known(nb::handle given, const char* name, Shape shape) {
    return in_place<double>(read("known", given, name, shape), name);
  }
  Bytes flags(nb::handle given, const char* name, Shape shape) {
    return in_place<std::uint8_t>(read("flags", given, name, shape), name);
  }
  /// Booleans of a picture.
  Bytes pixels(nb::handle given, const char* name, Shape shape) {
    return in_place<std::uint8_t>(read("pixels", given, name, shape), name);
  }

 private:
  nb::object read(const char* kind, nb::handle given, const char* name, Shape shape) {
    nb::list extents;
    for (const char* extent : shape) {
      extents.append(extent);
    }
    return reader_.attr(kind)(given, name, nb::tuple(extents));
  }

  nb::object reader_ = call("palpate._arrays", "Reader");
};

/// A pose (x_mm, y_mm, theta_rad), or a point (x_mm, y_mm).
inline Pose pose_of(nb::handle given, const char* name) {
  return ArrayReader().floats(given, name, {"3"}).copied<Pose>().front();
}
inline glm::dvec2 point_of(nb::handle given, const char* name) {
  return ArrayReader().floats(given, name, {"2"}).copied<glm::dvec2>().front();
}
/// Poses [n, 3], points [n, 2].
inline std::vector<Pose> poses_of(nb::handle given, const char* name) {
  return ArrayReader().floats(given, name, {"n", "3"}).copied<Pose>();
}
inline std::vector<glm::dvec2> points_of(nb::handle given, const char* name) {
  return ArrayReader().floats(given, name, {"n", "2"}).copied<glm::dvec2>();
}

/// A NumPy array as the result of a function. An object, so that no policy of nanobind's asks who
/// owns the memory: `owner` does.
template <typename Value, std::size_t rank>
class Result : public nb::object {
  using Array = nb::ndarray<nb::numpy, Value, nb::ndim<static_cast<nb::ssize_t>(rank)>>;

 public:
  static constexpr auto Name = nb::detail::make_caster<Array>::Name;
  static bool check_(nb::handle object) { return object.is_valid(); }

  Result(Value* data, const std::size_t (&shape)[rank], nb::handle owner)
      : nb::object(nb::cast(Array(data, rank, shape, owner), nb::rv_policy::automatic)) {}
};

/// The numbers that an item of an array holds: a Pose and a dvec2 are rows of doubles.
template <typename Row>
using NumberOf = std::conditional_t<std::is_arithmetic_v<Row>, Row, double>;

/// An array that takes over the vector's memory.
template <typename Row, std::size_t rank>
Result<NumberOf<Row>, rank> owned(std::vector<Row> rows, const std::size_t (&shape)[rank]) {
  auto* kept = new std::vector<Row>(std::move(rows));
  const nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<decltype(kept)>(p); });
  return {reinterpret_cast<NumberOf<Row>*>(kept->data()), shape, owner};
}
template <typename Value>
Result<Value, 1> owned(std::vector<Value> values) {
  const std::size_t n = values.size();
  return owned(std::move(values), {n});
}
/// [ntheta, ny, nx], of numbers of every bin of a lattice.
inline Result<double, 3> owned(std::vector<double> bins, const PoseLattice& lattice) {
  return owned(std::move(bins), {static_cast<std::size_t>(lattice.theta_rad.count),
                                 static_cast<std::size_t>(lattice.y_mm.count),
                                 static_cast<std::size_t>(lattice.x_mm.count)});
}
/// A read-only array over memory of an object of Python, which it keeps alive.
template <typename Value, std::size_t rank>
Result<const Value, rank> view(const Value* data, const std::size_t (&shape)[rank],
                               nb::handle owner) {
  return {data, shape, owner};
}

/// [3] or [n, 3] of x_mm, y_mm and theta_rad; [2] or [n, 2] in mm.
inline Result<double, 1> to_array(const Pose& pose) { return owned(std::vector{pose}, {3}); }
inline Result<double, 1> to_array(const glm::dvec2& point) {
  return owned(std::vector{point}, {2});
}
inline Result<double, 2> to_array(std::vector<Pose> poses) {
  const std::size_t n = poses.size();
  return owned(std::move(poses), {n, 3});
}
inline Result<double, 2> to_array(std::vector<glm::dvec2> points) {
  const std::size_t n = points.size();
  return owned(std::move(points), {n, 2});
}
inline std::optional<FloatArray> to_array(const std::optional<Pose>& pose) {
  return pose ? std::optional(nb::borrow<FloatArray>(to_array(*pose))) : std::nullopt;
}
/// [3, 3] of a covariance.
inline Result<double, 2> to_array(const std::array<double, 9>& covariance) {
  return owned(std::vector(covariance.begin(), covariance.end()), {3, 3});
}
inline Result<double, 1> to_array(const std::array<double, 3>& values) {
  return owned(std::vector(values.begin(), values.end()));
}

/// A member, or what a function gives, of every row.
template <typename Row, typename Member>
auto column(const std::vector<Row>& rows, Member member) {
  std::vector<std::decay_t<std::invoke_result_t<Member, const Row&>>> values;
  std::ranges::transform(rows, std::back_inserter(values), member);
  return values;
}

// Properties by the member that holds their values.

/// The member as an array of its own.
template <typename Class, typename Value>
auto array_of(Value Class::*member) {
  return [member](const Class& self) { return to_array(self.*member); };
}
/// [n], a view of the member.
template <typename Class, typename Value>
auto view_of(std::vector<Value> Class::*member) {
  return [member](nb::handle_t<Class> self) {
    const std::vector<Value>& values = nb::cast<const Class&>(self).*member;
    return view<Value, 1>(values.data(), {values.size()}, self);
  };
}

}  // namespace palpate::python
