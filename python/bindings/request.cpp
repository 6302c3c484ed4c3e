#include "request.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>
#include <string_view>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/variant.h>

#include "bindings.hpp"
#include "palpate/files.hpp"
#include "recognition/map_files.hpp"
#include "recognition/option_text.hpp"
#include "recognition/refused_option.hpp"

namespace palpate::python {

namespace {

using namespace nb::literals;

/// Throws TypeError where the value is of another type.
template <typename Value>
Value typed(nb::handle value) {
  Value result;
  if (!nb::try_cast(value, result)) {
    throw nb::type_error("another type is wanted");
  }
  return result;
}

// Each function takes an option's value from Python.

template <typename Value>
void take(const char* /*option*/, nb::handle given, Value& value) {
  value = typed<Value>(given);
}

/// Numbers, or a word that the option has.
template <typename Numbers>
std::variant<Numbers, std::string> numbers_or_word(const char* option, nb::handle given,
                                                   std::initializer_list<std::string_view> words) {
  auto value = typed<std::variant<Numbers, std::string>>(given);
  if (const auto* word = std::get_if<std::string>(&value)) {
    if (std::ranges::find(words, *word) == words.end()) {
      refuse_option(option, *word, "not known; give numbers, or {}",
                    fmt::format("'{}'", fmt::join(words.begin(), words.end(), "' or '")));
    }
  }
  return value;
}

void take(const char* option, nb::handle given, Bins& value) {
  const auto bins = numbers_or_word<std::array<int, 3>>(option, given, {"auto", "fine"});
  if (const auto* counts = std::get_if<std::array<int, 3>>(&bins)) {
    value = *counts;
  } else {
    value = std::get<std::string>(bins) == "fine" ? BinWidth::fine : BinWidth::automatic;
  }
}

void take(const char* option, nb::handle given, Pivot& value) {
  const auto pivot = numbers_or_word<std::array<double, 2>>(option, given, {"auto"});
  if (const auto* xy = std::get_if<std::array<double, 2>>(&pivot)) {
    value = glm::dvec2((*xy)[0], (*xy)[1]);
  } else {
    value = Automatic{};
  }
}

void take(const char* option, nb::handle given, NoneWeight& value) {
  const auto weight = numbers_or_word<double>(option, given, {"auto"});
  if (const auto* number = std::get_if<double>(&weight)) {
    value = *number;
  } else {
    value = Automatic{};
  }
}

void take(const char* option, nb::handle given, Frames& value) {
  const auto [begin, end] = typed<std::array<std::int64_t, 2>>(given);
  if (begin < 0 || end < 0) {
    refuse_option(option, fmt::format("{}:{}", begin, end),
                  "touches are counted from 0; give none below");
  }
  value = {static_cast<std::size_t>(begin), static_cast<std::size_t>(end)};
}

void take(const char* /*option*/, nb::handle given, FilterKind& value) {
  value = filter_named(typed<std::string>(given));
}

void take(const char* /*option*/, nb::handle given, Resampling& value) {
  value = resampling_named(typed<std::string>(given));
}

template <typename Value>
void take(const char* option, nb::handle given, std::optional<Value>& value) {
  take(option, given, value.emplace());
}

void set_option(Request& request, std::string option, nb::handle given) {
  if (option == "device") {
    const auto device = typed<std::variant<std::int64_t, std::string>>(given);
    const auto* index = std::get_if<std::int64_t>(&device);
    request.device = index != nullptr ? std::to_string(*index) : std::get<std::string>(device);
    return;
  }
  std::ranges::replace(option, '_', '-');
  visit_options(request, [&](const char* name, auto& value) {
    if (option == name) {
      take(name, given, value);
    }
  });
}

}  // namespace

void add_maps(const nb::list& items, Request& request) {
  for (const nb::handle item : items) {
    const OccupancyGrid* map = nullptr;
    const Hypothesis* hypothesis = nullptr;
    const bool is_map = nb::try_cast(item, map) && map != nullptr;
    if (is_map || (nb::try_cast(item, hypothesis) && hypothesis != nullptr)) {
      const Hypothesis given = is_map ? Hypothesis{.map = *map} : *hypothesis;
      request.given_maps.push_back({fmt::format("map '{}'", given.map.label), given});
    } else {
      request.maps.push_back(nb::borrow<PathLike>(item).text());
    }
  }
  if (request.given_maps.empty()) {
    return;
  }
  for (const std::string& argument : request.maps) {
    for (const std::filesystem::path& file : map_files(argument)) {
      request.given_maps.push_back({file.string(), {.map = read_map(file)}});
    }
  }
}

void bind_request(nb::module_& module) {
  nb::class_<Request>(module, "Request", "What is asked of a recognition.")
      .def(nb::init<>())
      .def("set", &set_option, "option"_a, "value"_a,
           "Sets an option of recognize(). Raises TypeError where the value is of another type.");
}

}  // namespace palpate::python
