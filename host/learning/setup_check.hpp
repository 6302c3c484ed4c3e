#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/map_builder.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Something that the touches say is wrong with the set-up.
struct SetupFinding {
  /// "pose_unit", "element_order", "array_offset", "pitch", "dead_elements", "stuck_elements" or
  /// "contradicting".
  std::string what;
  double nats = 0.0;   ///< by how much more likely the touches are once it is mended
  std::string words;   ///< a sentence, options between `quotes`
  std::string option;  ///< that mends it, such as "dead 13,42"; "" where none does
  /// Pose of the recordings' array in the true sensor frame, to be applied to the elements, with
  /// its standard deviations in mm, mm and rad.
  std::optional<Pose> array_offset = {};
  std::optional<std::array<double, 3>> sd = {};
};

struct SetupCheck {
  std::vector<SetupFinding> findings;   ///< empty where the set-up is sound
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
/// contact, and as MapBuilder does
SetupCheck check_setup(Device& device, std::span<const Recording> recordings,
                       const MapOptions& options, const std::function<void(double)>& progress = {});

/// The finding "element_order" from a few touches of a few objects, in a fraction of a second; none
/// where there is none, or the recordings do not allow for it.
/// @throws Error as MapBuilder does
std::optional<SetupFinding> suspected_order(Device& device, std::span<const Recording> recordings,
                                            const MapOptions& options);

}  // namespace palpate
