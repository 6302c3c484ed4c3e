#include "request.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/variant.h>

#include "bindings.hpp"
#include "io/recording_rules.hpp"
#include "model/option_words.hpp"
#include "options/option.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "recognition/recordings.hpp"
#include "touches.hpp"

namespace palpate::python {

namespace {

using namespace nb::literals;

/// The value as C++ has it. Throws TypeError, which Python words, where it is of another type.
template <typename Value>
Value typed(nb::handle value) {
  return value_of<Value>(value, "another type is wanted");
}

/// What Python gives for the value of an option.
template <typename Value>
struct Given : std::type_identity<std::conditional_t<std::is_enum_v<Value>, std::string, Value>> {};
template <>
struct Given<Bins> : std::type_identity<std::variant<std::array<int, 3>, std::string>> {};
template <>
struct Given<Pivot> : std::type_identity<std::variant<std::array<double, 2>, std::string>> {};
template <>
struct Given<NoneWeight> : std::type_identity<std::variant<double, std::string>> {};
template <>
struct Given<Frames> : std::type_identity<std::array<std::int64_t, 2>> {};

/// The text of an option's value, as a flag has it.
struct OptionText {
  nb::handle given;
  std::string separator;  ///< of numbers

  template <typename Value>
  std::string operator()(Value Request::* /*of*/) const {
    return text(typed<typename Given<Value>::type>(given));
  }
  template <typename Value>
  std::string operator()(std::optional<Value> Request::* /*of*/) const {
    return text(typed<typename Given<Value>::type>(given));
  }

 private:
  template <typename Value>
  std::string text(const Value& value) const {
    return fmt::format("{}", value);
  }
  template <typename Number, std::size_t n>
  std::string text(const std::array<Number, n>& numbers) const {
    return fmt::format("{}", fmt::join(numbers, separator));
  }
  template <typename... Values>
  std::string text(const std::variant<Values...>& values) const {
    return std::visit([&](const auto& value) { return text(value); }, values);
  }
};

void set_option(PythonRequest& request, std::string option, nb::handle given) {
  if (option == "device") {
    const auto device =
        typed<std::variant<std::shared_ptr<Device>, std::int64_t, std::string>>(given);
    if (const auto* open = std::get_if<std::shared_ptr<Device>>(&device)) {
      request.open_device = *open;
    } else {
      const auto* index = std::get_if<std::int64_t>(&device);
      request.device = index != nullptr ? std::to_string(*index) : std::get<std::string>(device);
    }
    return;
  }
  std::ranges::replace(option, '_', '-');
  const auto row = std::ranges::find(options(), option, &Option::name);
  if (row == options().end()) {
    throw nb::attribute_error(option.c_str());
  }
  const auto separator = separator_of(*row);
  const std::string text =
      std::visit(OptionText{given, separator ? std::string(1, *separator) : ""}, row->member);
  if (const std::string remedy = palpate::set_option(request, *row, text); !remedy.empty()) {
    refuse_option(option, text, "{}", remedy);
  }
}

/// A list of what an argument gives: one item, or an iterable of them.
nb::object items_of(nb::handle given) {
  const bool is_one = is_path(given.ptr()) || is_recording(given.ptr()) ||
                      nb::isinstance<OccupancyGrid>(given) || nb::isinstance<Hypothesis>(given);
  return call("builtins", "list", is_one ? nb::make_tuple(given) : nb::borrow(given));
}

std::string path_in(nb::handle item, const char* argument, const char* wanted) {
  if (!is_path(item.ptr())) {
    throw nb::type_error(
        fmt::format("{}: holds a {}; give {}", argument, nb::inst_name(item).c_str(), wanted)
            .c_str());
  }
  return nb::borrow<PathLike>(item).text();
}

}  // namespace

nb::object to_python(const nlohmann::ordered_json& json) {
  switch (json.type()) {
    case nlohmann::ordered_json::value_t::object: {
      nb::dict result;
      for (const auto& [key, value] : json.items()) {
        result[key.c_str()] = to_python(value);
      }
      return result;
    }
    case nlohmann::ordered_json::value_t::array: {
      nb::list result;
      for (const nlohmann::ordered_json& value : json) {
        result.append(to_python(value));
      }
      return result;
    }
    case nlohmann::ordered_json::value_t::string: {
      const auto& text = json.get_ref<const std::string&>();
      // The path of a recording need not be UTF-8.
      return nb::steal(
          PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size())));
    }
    case nlohmann::ordered_json::value_t::boolean:
      return nb::bool_(json.get<bool>());
    case nlohmann::ordered_json::value_t::number_integer:
      return nb::int_(json.get<std::int64_t>());
    case nlohmann::ordered_json::value_t::number_unsigned:
      return nb::int_(json.get<std::uint64_t>());
    case nlohmann::ordered_json::value_t::number_float:
      return nb::float_(json.get<double>());
    default:
      return nb::none();
  }
}

void add_maps(nb::handle given, Request& request) {
  for (const nb::handle item : items_of(given)) {
    if (const auto hypothesis = hypothesis_in(item)) {
      request.given_maps.push_back({fmt::format("map '{}'", hypothesis->map.label), *hypothesis});
    } else {
      request.maps.push_back(path_in(item, "maps", "OccupancyGrid, Hypothesis or files"));
    }
  }
  if (!request.given_maps.empty()) {
    read_maps(request);
  }
}

void read_maps(Request& request) {
  for (const std::string& argument : request.maps) {
    for (const std::filesystem::path& file : map_files(argument)) {
      request.given_maps.push_back({file.string(), {.map = read_map(file)}});
    }
  }
}

std::vector<Recording> recordings_of(nb::handle given) {
  std::vector<Recording> recordings;
  std::vector<std::string> files;  // of the recordings without a path
  for (const nb::handle item : items_of(given)) {
    if (is_recording(item.ptr())) {
      Recording& copy = recordings.emplace_back(recording_of(nb::borrow<RecordingObject>(item)));
      if (copy.path.empty()) {
        copy.path = fmt::format("recordings[{}]", recordings.size() - 1);
      }
      require_head(copy.path, copy, copy.elements());
    } else {
      files.push_back(path_in(item, "recordings", "Recordings or files"));
      recordings.emplace_back();
    }
  }
  if (recordings.empty()) {
    throw Error(Fault::input, "recordings: none; give a Recording or a file");
  }
  std::vector<Recording> read_files = run([&] { return read_touch_recordings(files); });
  auto file = read_files.begin();
  for (Recording& recording : recordings) {
    if (recording.path.empty()) {
      recording = std::move(*file++);
    }
    require_touches(recording, recordings.front());
  }
  return recordings;
}

Sentences in_python(Sentences sentences) {
  std::ranges::transform(sentences, sentences.begin(), in_keywords);
  return sentences;
}

void bind_request(nb::module_& module) {
  nb::class_<PythonRequest>(module, "Request", "What is asked of a recognition.")
      .def(
          "__init__",
          [](PythonRequest* self, nb::handle maps) {
            PythonRequest request;
            add_maps(maps, request);
            new (self) PythonRequest(std::move(request));
          },
          "maps"_a = nb::make_tuple())
      .def("__setattr__", &set_option, "option"_a, "value"_a,
           "Sets an option of recognize(). Raises TypeError where the value is of another type.")
      .def_static(
          "options",
          [] {
            std::vector<std::string> names;
            for (const Option& option : options()) {
              names.emplace_back(option.name);
              std::ranges::replace(names.back(), '-', '_');
            }
            return names;
          },
          "The names of all options of recognize().");
}

}  // namespace palpate::python
