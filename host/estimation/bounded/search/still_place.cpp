#include "estimation/bounded/search/still_place.hpp"

#include <algorithm>

#include "estimation/bounded/tables/reading_penalties.hpp"
#include "estimation/bounded/tables/tile_penalties.hpp"

namespace palpate {

namespace {

/// So many elements' penalties never add up to the largest sum, nor do half as many's changes,
/// which may be twice as large.
constexpr std::size_t most_elements = largest_sum / largest_penalty;

/// Whether most elements are in No Contact.
bool mostly_no_contact(const ArrayReadings& touch) {
  const auto none = static_cast<std::size_t>(
      std::count(touch.readings.begin(), touch.readings.end(), Reading::no_contact));
  return 2 * none > touch.readings.size();
}

}  // namespace

StillPlace::Seen StillPlace::look(const ArrayReadings& touch) {
  const bool stays = touch.from_pivot_mm == last_;
  if (!stays) {
    last_ = touch.from_pivot_mm;
  }
  if (touch.readings.size() > most_elements || !mostly_no_contact(touch)) {
    return Seen::moving;
  }
  if (touch.from_pivot_mm == kept_) {
    return Seen::still;
  }
  if (!stays) {
    return Seen::moving;
  }
  kept_.clear();
  return Seen::stopped;
}

}  // namespace palpate
