#pragma once

#include <nlohmann/json.hpp>

#include "types.hpp"

namespace palpate::python {

/// What a result holds, as in the JSON of a command; palpate.results makes attributes of the keys.
using Fields = nb::typed<nb::dict, nb::str, nb::any>;

nb::object to_python(const nlohmann::ordered_json& json);
/// @param json an object
inline Fields fields_of(const nlohmann::ordered_json& json) {
  return nb::borrow<Fields>(to_python(json));
}

}  // namespace palpate::python
