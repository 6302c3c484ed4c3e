#include "learning/unposed_maps.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "learning/fused_map.hpp"
#include "learning/observed_map.hpp"
#include "learning/press_fusion.hpp"
#include "model/element_spacing.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// The final map: images are computed at their places.
UnposedMap final_map(std::size_t map, std::span<const UnposedPress> presses,
                     std::span<const PressHome> homes, const std::string& label,
                     const UnposedOptions& options) {
  UnposedMap result;
  FusedMap sums(options.map);
  for (std::size_t p = 0; p < presses.size(); ++p) {
    const PressHome& home = homes[p];
    if (home.map != map) {
      continue;
    }
    Touch touch = presses[p].sides[home.place.mirrored ? 1 : 0].touch();
    touch.T_robot_sensor = home.place.T_object_robot * touch.T_robot_sensor;
    const double weight = home.image_place().weight;
    sums.add(observed_map(std::span(&touch, 1), options.map, label), {.weight = weight});
    result.presses.push_back({.press = presses[p].index,
                              .T_object_sensor = touch.T_robot_sensor,
                              .mirrored = home.place.mirrored,
                              .weight = weight,
                              .fit = home.fit});
  }
  if (result.presses.empty()) {
    return result;
  }
  if (result.presses.size() == 1) {
    result.presses.front().fit = {};
  }
  result.map = sums.map(label);
  result.map.mirror = options.mirror;
  if (const auto fault = fault_of(result.map)) {
    throw Error(Fault::input, fmt::format("map '{}': {}", label, *fault));
  }
  return result;
}

}  // namespace

double element_pitch_mm(std::span<const Touch> presses) {
  std::optional<double> least;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const bool same = i > 0 && presses[i].elements_mm.data() == presses[i - 1].elements_mm.data();
    if (const auto pitch_mm = same ? std::nullopt : pitch_of(presses[i].elements_mm)) {
      least = std::min(least.value_or(*pitch_mm), *pitch_mm);
    }
  }
  if (!least) {
    throw Error(Fault::input, "presses at unknown poses need an array of several elements");
  }
  return *least;
}

UnposedMaps unposed_maps(std::span<const Touch> presses, const std::string& label,
                         const UnposedOptions& given, const std::function<void(double)>& progress) {
  UnposedOptions options = given;
  if (options.most_maps < 1) {
    throw Error(Fault::input, "most maps = 0: give at least 1");
  }
  if (!options.contact.prior) {
    options.contact.prior = options.map.sensor.prior;
  }
  options.contact.validate();
  const double step_mm = element_pitch_mm(presses);
  UnposedMaps result;
  std::vector<UnposedPress> placeable;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    UnposedPress press{.index = i, .sides = {}, .image = {}};
    press.sides.emplace_back(presses[i], options.contact, false);
    if (options.mirror) {
      press.sides.emplace_back(presses[i], options.contact, true);
    }
    if (!press.sides.front().in_contact()) {
      result.misfits.push_back({.press = i, .reason = Misfit::Reason::no_contact});
      continue;
    }
    placeable.push_back(std::move(press));
  }
  if (placeable.empty()) {
    throw Error(Fault::input, fmt::format("object '{}': no press has an element In Contact; check "
                                          "the threshold and the pressure's unit",
                                          label));
  }
  tbb::parallel_for(std::size_t{0}, placeable.size(), [&](std::size_t p) {
    placeable[p].image =
        observed_map(std::span(&placeable[p].sides.front().touch(), 1), options.map, label);
  });

  const FusedPresses fused = fuse_presses(placeable, options, step_mm, progress);
  result.rounds = fused.rounds;
  result.settled = fused.settled;
  for (std::size_t p = 0; p < placeable.size(); ++p) {
    const PressHome& home = fused.homes[p];
    if (!home.map) {
      result.misfits.push_back(
          {.press = placeable[p].index,
           .reason = home.too_little_contact ? Misfit::Reason::too_little : Misfit::Reason::unlike,
           .fit = home.fit});
    }
  }
  std::ranges::sort(result.misfits, {}, &Misfit::press);
  for (std::size_t map = 0; map < fused.maps; ++map) {
    UnposedMap one = final_map(map, placeable, fused.homes, label, options);
    if (!one.presses.empty()) {
      result.maps.push_back(std::move(one));
    }
  }
  std::ranges::stable_sort(result.maps, std::ranges::greater{},
                           [](const UnposedMap& map) { return map.presses.size(); });
  return result;
}

}  // namespace palpate
