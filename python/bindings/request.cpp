#include "request.hpp"

#include <string>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <nanobind/stl/optional.h>

#include "bindings.hpp"
#include "cli/map_files.hpp"
#include "palpate/files.hpp"

namespace palpate::python {

namespace {

/// Adds a flag, `get(request)`.
template <typename Get>
void add_flag(nb::class_<Request>& request, const char* name, Get get) {
  using Value = std::remove_cvref_t<decltype(get(std::declval<Request&>()))>;
  request.def_prop_rw(
      name, [get](Request& self) -> Value { return get(self); },
      [get](Request& self, const Value& value) { get(self) = value; });
}

void add_text_flags(nb::class_<Request>& request) {
  add_flag(
      request, "scene", [](Request & of) -> auto& { return of.flags.scene; });
  add_flag(
      request, "bins", [](Request & of) -> auto& { return of.flags.bins; });
  add_flag(
      request, "x_mm", [](Request & of) -> auto& { return of.flags.x_mm; });
  add_flag(
      request, "y_mm", [](Request & of) -> auto& { return of.flags.y_mm; });
  add_flag(
      request, "theta_deg", [](Request & of) -> auto& { return of.flags.theta_deg; });
  add_flag(
      request, "pivot_mm", [](Request & of) -> auto& { return of.flags.pivot_mm; });
  add_flag(
      request, "sensor_model", [](Request & of) -> auto& { return of.flags.sensor_model; });
  add_flag(
      request, "none", [](Request & of) -> auto& { return of.flags.uncertainty.none; });
  add_flag(
      request, "filter", [](Request & of) -> auto& { return of.flags.filter.filter; });
  add_flag(
      request, "resampling", [](Request & of) -> auto& { return of.flags.filter.resampling; });
  add_flag(
      request, "device", [](Request & of) -> auto& { return of.flags.device; });
  add_flag(
      request, "frames", [](Request & of) -> auto& { return of.unknowns.frames; });
}

void add_number_flags(nb::class_<Request>& request) {
  add_flag(
      request, "prior", [](Request & of) -> auto& { return of.flags.prior; });
  add_flag(
      request, "gamma", [](Request & of) -> auto& { return of.flags.gamma; });
  add_flag(
      request, "threshold", [](Request & of) -> auto& { return of.flags.threshold; });
  add_flag(
      request, "ratio", [](Request & of) -> auto& { return of.flags.ratio; });
  add_flag(
      request, "touch_sd_mm",
      [](Request & of) -> auto& { return of.flags.uncertainty.touch_sd_mm; });
  add_flag(
      request, "touch_sd_deg",
      [](Request & of) -> auto& { return of.flags.uncertainty.touch_sd_deg; });
  add_flag(
      request, "slip_sd_mm", [](Request & of) -> auto& { return of.flags.uncertainty.slip_sd_mm; });
  add_flag(
      request, "slip_sd_deg",
      [](Request & of) -> auto& { return of.flags.uncertainty.slip_sd_deg; });
  add_flag(
      request, "tolerance", [](Request & of) -> auto& { return of.flags.filter.tolerance; });
  add_flag(
      request, "budget_ms", [](Request & of) -> auto& { return of.flags.filter.budget_ms; });
  add_flag(
      request, "evidence_nats",
      [](Request & of) -> auto& { return of.flags.filter.evidence_nats; });
  add_flag(
      request, "particles", [](Request & of) -> auto& { return of.flags.filter.particles; });
  add_flag(
      request, "augmented", [](Request & of) -> auto& { return of.flags.filter.augmented; });
  add_flag(
      request, "seed", [](Request & of) -> auto& { return of.flags.filter.seed; });
  add_flag(
      request, "memory_mib", [](Request & of) -> auto& { return of.flags.filter.memory_mib; });
  add_flag(
      request, "touches", [](Request & of) -> auto& { return of.unknowns.touches; });
  add_flag(
      request, "each_frame", [](Request & of) -> auto& { return of.unknowns.each_frame; });
  add_flag(
      request, "trace", [](Request & of) -> auto& { return of.trace; });
}

}  // namespace

void add_maps(const nb::list& items, cli::RecognitionFlags& flags) {
  for (const nb::handle item : items) {
    const OccupancyGrid* map = nullptr;
    const Hypothesis* hypothesis = nullptr;
    const bool is_map = nb::try_cast(item, map) && map != nullptr;
    if (is_map || (nb::try_cast(item, hypothesis) && hypothesis != nullptr)) {
      const Hypothesis given = is_map ? Hypothesis{.map = *map} : *hypothesis;
      flags.given_maps.push_back({fmt::format("map '{}'", given.map.label), given});
    } else {
      flags.maps.push_back(nb::borrow<PathLike>(item).text());
    }
  }
  if (flags.given_maps.empty()) {
    return;
  }
  for (const std::string& argument : flags.maps) {
    for (const std::filesystem::path& file : cli::map_files(argument)) {
      flags.given_maps.push_back({file.string(), {.map = read_map(file)}});
    }
  }
}

void bind_request(nb::module_& module) {
  nb::class_<Request> request(module, "RecognitionFlags",
                              "The flags of `palpate recognize`, as texts and numbers.");
  request.def(nb::init<>());
  add_text_flags(request);
  add_number_flags(request);
}

}  // namespace palpate::python
