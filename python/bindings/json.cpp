#include "json.hpp"

#include <cstdint>

namespace palpate::python {

using Json = nlohmann::ordered_json;

nb::object to_python(const Json& json) {
  switch (json.type()) {
    case Json::value_t::object: {
      nb::dict result;
      for (const auto& [key, value] : json.items()) {
        result[key.c_str()] = to_python(value);
      }
      return result;
    }
    case Json::value_t::array: {
      nb::list result;
      for (const Json& value : json) {
        result.append(to_python(value));
      }
      return result;
    }
    case Json::value_t::string: {
      const auto& text = json.get_ref<const std::string&>();
      // The path of a recording need not be UTF-8.
      return nb::steal(
          PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size())));
    }
    case Json::value_t::boolean:
      return nb::bool_(json.get<bool>());
    case Json::value_t::number_integer:
      return nb::int_(json.get<std::int64_t>());
    case Json::value_t::number_unsigned:
      return nb::int_(json.get<std::uint64_t>());
    case Json::value_t::number_float:
      return nb::float_(json.get<double>());
    default:
      return nb::none();
  }
}

}  // namespace palpate::python
