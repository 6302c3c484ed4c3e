#include "request.hpp"

#include <array>
#include <map>
#include <string>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/variant.h>

#include "bindings.hpp"
#include "palpate/files.hpp"
#include "recognition/map_files.hpp"
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

template <auto member>
void set(Request& request, nb::handle value) {
  request.*member = typed<std::remove_cvref_t<decltype(request.*member)>>(value);
}

void set_bins(Request& request, nb::handle value) {
  const auto bins = typed<std::variant<std::array<int, 3>, std::string>>(value);
  if (const auto* counts = std::get_if<std::array<int, 3>>(&bins)) {
    request.bins = *counts;
    return;
  }
  const auto& word = std::get<std::string>(bins);
  if (word != "auto" && word != "fine") {
    refuse_option("bins", word, "give counts of x, y and theta, or 'auto', or 'fine'");
  }
  request.bins = word == "fine" ? BinWidth::fine : BinWidth::automatic;
}

/// Takes "auto" for Automatic.
template <typename Value>
std::variant<Value, Automatic> or_automatic(const char* option, nb::handle value) {
  const auto given = typed<std::variant<Value, std::string>>(value);
  if (const auto* word = std::get_if<std::string>(&given)) {
    if (*word != "auto") {
      refuse_option(option, *word, "not known; give numbers, or 'auto'");
    }
    return Automatic{};
  }
  return std::get<Value>(given);
}

void set_pivot(Request& request, nb::handle value) {
  const auto pivot = or_automatic<std::array<double, 2>>("pivot-mm", value);
  if (const auto* xy = std::get_if<std::array<double, 2>>(&pivot)) {
    request.pivot_mm = glm::dvec2((*xy)[0], (*xy)[1]);
  } else {
    request.pivot_mm = Automatic{};
  }
}

void set_frames(Request& request, nb::handle value) {
  const auto [begin, end] = typed<std::array<std::int64_t, 2>>(value);
  if (begin < 0 || end < 0) {
    refuse_option("frames", fmt::format("{}:{}", begin, end),
                  "touches are counted from 0; give none below");
  }
  request.frames = {static_cast<std::size_t>(begin), static_cast<std::size_t>(end)};
}

void set_device(Request& request, nb::handle value) {
  const auto device = typed<std::variant<std::int64_t, std::string>>(value);
  const auto* index = std::get_if<std::int64_t>(&device);
  request.device = index != nullptr ? std::to_string(*index) : std::get<std::string>(device);
}

using Set = void (*)(Request&, nb::handle);

const std::map<std::string, Set>& options() {
  static const std::map<std::string, Set> all{
      {"scene", set<&Request::scene>},
      {"sensor_model", set<&Request::sensor_model>},
      {"bins", set_bins},
      {"x_mm", set<&Request::x_mm>},
      {"y_mm", set<&Request::y_mm>},
      {"theta_deg", set<&Request::theta_deg>},
      {"pivot_mm", set_pivot},
      {"prior", set<&Request::prior>},
      {"gamma", set<&Request::gamma>},
      {"threshold", set<&Request::threshold>},
      {"ratio", set<&Request::ratio>},
      {"touch_sd_mm", set<&Request::touch_sd_mm>},
      {"touch_sd_deg", set<&Request::touch_sd_deg>},
      {"slip_sd_mm", set<&Request::slip_sd_mm>},
      {"slip_sd_deg", set<&Request::slip_sd_deg>},
      {"none", [](Request& request,
                  nb::handle value) { request.none = or_automatic<double>("none", value); }},
      {"filter",
       [](Request& request, nb::handle value) {
         request.filter = filter_named(typed<std::string>(value));
       }},
      {"tolerance", set<&Request::tolerance>},
      {"budget_ms", set<&Request::budget_ms>},
      {"evidence_nats", set<&Request::evidence_nats>},
      {"particles", set<&Request::particles>},
      {"resampling",
       [](Request& request, nb::handle value) {
         request.resampling = resampling_named(typed<std::string>(value));
       }},
      {"augmented", set<&Request::augmented>},
      {"seed", set<&Request::seed>},
      {"memory_mib", set<&Request::memory_mib>},
      {"device", set_device},
      {"frames", set_frames},
      {"touches", set<&Request::touches>},
      {"each_frame", set<&Request::each_frame>},
      {"trace", set<&Request::trace>}};
  return all;
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
      .def(
          "set",
          [](Request& self, const std::string& option, nb::handle value) {
            options().at(option)(self, value);
          },
          "option"_a, "value"_a,
          "Sets an option of recognize(). Raises TypeError where the value is of another type.");
}

}  // namespace palpate::python
