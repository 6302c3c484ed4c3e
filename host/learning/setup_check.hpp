#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/map_builder.hpp"
#include "palpate/touch.hpp"

namespace palpate {

struct SetupCheck {
  /// Empty where the set-up is sound. Those that the recordings bring come last.
  std::vector<SetupFinding> findings;
  std::vector<std::string> remarks;     ///< what these touches cannot tell, in sentences
  std::vector<glm::dvec2> elements_mm;  ///< [e] the array as the findings correct it
  std::size_t touches = 0;              ///< with an element In Contact
};

/// Asks touches at known poses which set-up explains them best: how likely each half of an object's
/// touches is (Eq. 7) on the map that the other half makes.
/// @param recordings of objects that stay in their place, all with one array
/// @param options of the maps; the prior is estimated
/// @param progress called now and then with the fraction done
/// @throws Error on recordings of unlike arrays, where an object has fewer than four touches in
/// contact though nothing is wrong with its log, and as MapBuilder does
SetupCheck check_setup(Device& device, std::span<const Recording> recordings,
                       const MapOptions& options, const std::function<void(double)>& progress = {});

/// The finding "element_order" from a few touches of a few objects, in a fraction of a second; none
/// where there is none, or the recordings do not allow for it.
/// @throws Error as MapBuilder does
std::optional<SetupFinding> suspected_order(Device& device, std::span<const Recording> recordings,
                                            const MapOptions& options);

}  // namespace palpate
