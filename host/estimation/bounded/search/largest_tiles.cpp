#include "estimation/bounded/search/largest_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimation/bounded/displaced/displaced_tiles.hpp"
#include "estimation/bounded/parallel_for.hpp"

namespace palpate {

namespace {

/// Batches of the largest tiles at one theta that make a region small.
constexpr int few_batches = 16;

/// So many elements' penalties never add up to the largest sum, nor do half as many's changes,
/// which may be twice as large.
constexpr std::size_t most_still_elements = largest_sum / largest_penalty;

/// Whether most elements are in No Contact.
bool mostly_no_contact(const ArrayReadings& touch) {
  const auto none = static_cast<std::size_t>(
      std::count(touch.readings.begin(), touch.readings.end(), Reading::no_contact));
  return 2 * none > touch.readings.size();
}

/// The tiles of an axis that overlap [lower, upper] in mm.
std::pair<int, int> overlapping(const TileAxis& axis, double lower_mm, double upper_mm) {
  // Rounding must not leave a tile out.
  const auto tiles = static_cast<double>(axis.tiles());
  const double first = std::floor((lower_mm - axis.first_mm) / axis.side_mm - 1e-6);
  const double last = std::floor((upper_mm - axis.first_mm) / axis.side_mm + 1e-6);
  return {static_cast<int>(std::clamp(first, 0.0, tiles)),
          static_cast<int>(std::clamp(last + 1.0, 0.0, tiles))};
}

}  // namespace

StillPlace::Seen StillPlace::look(const ArrayReadings& touch) {
  const bool stays = touch.from_pivot_mm == last_;
  if (!stays) {
    last_ = touch.from_pivot_mm;
  }
  if (touch.sensor_from_pivot_mm || touch.readings.size() > most_still_elements ||
      !mostly_no_contact(touch)) {
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

LargestTiles::LargestTiles(SearchSpace& space) : space_(space), unseen_(space.bounds.size()) {
  for (const TileBounds& bounds : space.bounds) {
    const TileLevel& level = bounds.levels().front();
    sums_.emplace_back(space.turns.size() * level.batches_x() * level.batches_y() * batch_tiles);
  }
}

void LargestTiles::reset() {
  touches_ = 0;
  for (std::vector<std::int32_t>& sums : sums_) {
    std::fill(sums.begin(), sums.end(), 0);
  }
  std::fill(unseen_.begin(), unseen_.end(), 0);
  most_.clear();
}

void LargestTiles::add(std::span<const ArrayReadings> touches) {
  touches_ += touches.size();
  const TileLevel& level = space_.bounds.front().levels().front();
  // A single touch sees little of a large region; in a small one, fewer rounds are faster.
  if (touches.size() == 1 || level.batches_x() * level.batches_y() > few_batches) {
    for (const ArrayReadings& touch : touches) {
      add_touch(touch);
    }
    return;
  }
  std::vector<KnownElements> known;
  for (const ArrayReadings& touch : touches) {
    known.push_back(known_elements(touch));
  }
  add(merged(known));
}

void LargestTiles::add_touch(const ArrayReadings& touch) {
  const StillPlace::Seen seen = still_.look(touch);
  if (seen == StillPlace::Seen::moving) {
    add(known_elements(touch));
    return;
  }
  if (seen == StillPlace::Seen::stopped) {
    ArrayReadings no_contact = touch;
    std::fill(no_contact.readings.begin(), no_contact.readings.end(), Reading::no_contact);
    keep_still(known_elements(no_contact));
    still_.keep();
  }
  const KnownElements changed = changed_elements(touch);
  add_sums(known_elements(touch), changed, [&](const Strip& of, std::uint32_t* sums) {
    const auto still = still_sums_[of.object].begin() + static_cast<std::ptrdiff_t>(of.first);
    std::copy(still, still + std::ptrdiff_t{batch_tiles} * of.batches, sums);
    space_.bounds[of.object].add_changes(changed, of.placed, of.x, of.y, sums, of.batches);
  });
}

void LargestTiles::add(const KnownElements& elements) {
  if (space_.displacement) {
    for (const KnownElements& touch : elements.touches) {
      add_displaced(touch);
    }
    return;
  }
  add_sums(elements, elements, [&](const Strip& of, std::uint32_t* sums) {
    space_.bounds[of.object].add(0, elements, of.placed, of.x, of.y, sums, of.batches);
  });
}

void LargestTiles::add_displaced(const KnownElements& touch) {
  const std::vector<std::int64_t> offsets = offsets_of(touch);
  const std::vector<BoundingBox> reaches = displaced_reaches(space_, std::span(&touch, 1));
  std::vector<double>& most = most_.emplace_back();
  for (std::size_t object = 0; object < space_.bounds.size(); ++object) {
    const TileLevel& level = space_.bounds[object].levels().front();
    std::vector<BlockRun> seen;
    for (std::size_t theta = 0; theta < space_.turns.size(); ++theta) {
      const TileRange tiles = seen_tiles(reaches[theta], space_.maps[object], level);
      const int x = tiles.x_first / batch_side;
      const int x_end = (tiles.x_end + batch_side - 1) / batch_side;
      for (int y = tiles.y_first / batch_side; x < x_end && y * batch_side < tiles.y_end; ++y) {
        seen.push_back({static_cast<int>(theta), y, x, x_end - x});
      }
    }
    const std::vector<std::int32_t> added = displaced_penalties(space_, object, 0, touch, seen);
    auto least = static_cast<std::int32_t>(space_.bounds[object].penalty_beyond(0, touch));
    if (!added.empty()) {
      least = std::min(least, std::ranges::min(added));
    }
    most.push_back(space_.bounds[object].best(0, touch) - least / penalties_per_nat);
    auto from = added.begin();
    for (const BlockRun& run : seen) {
      const auto place = static_cast<std::size_t>(
          (std::int64_t{run.theta} * level.batches_y() + run.y) * level.batches_x() + run.x);
      std::int32_t* sums = sums_[object].data() + place * batch_tiles;
      for (int i = 0; i < run.count * batch_tiles; ++i) {
        const std::int64_t sum = std::int64_t{sums[i]} + *from++ - offsets[object];
        sums[i] = static_cast<std::int32_t>(std::min<std::int64_t>(sum, largest_sum));
      }
    }
  }
  raise_unseen(offsets);
}

void LargestTiles::keep_still(const KnownElements& no_contact) {
  still_sums_.resize(space_.bounds.size());
  parallel_for(space_.bounds.size(), [&](std::size_t i) {
    space_.bounds[i].make_change_tables();
    still_sums_[i].resize(sums_[i].size());
  });
  for_seen(no_contact, no_contact, [&](const Strip& of) {
    std::uint32_t* sums = still_sums_[of.object].data() + of.first;
    std::fill(sums, sums + std::ptrdiff_t{batch_tiles} * of.batches, 0);
    space_.bounds[of.object].add(0, no_contact, of.placed, of.x, of.y, sums, of.batches);
  });
}

template <typename Sum>
void LargestTiles::add_sums(const KnownElements& known, const KnownElements& placed,
                            const Sum& sum_of) {
  const std::vector<std::int64_t> offsets = offsets_of(known);
  for_seen(known, placed, [&](const Strip& of) {
    std::uint32_t added[most_strip * batch_tiles] = {};
    sum_of(of, added);
    std::int32_t* sums = sums_[of.object].data() + of.first;
    for (int i = 0; i < of.batches * batch_tiles; ++i) {
      const std::int64_t sum = std::int64_t{sums[i]} + added[i] - offsets[of.object];
      sums[i] = static_cast<std::int32_t>(std::min<std::int64_t>(sum, largest_sum));
    }
  });
  raise_unseen(offsets);
}

std::vector<std::int64_t> LargestTiles::offsets_of(const KnownElements& known) const {
  std::vector<std::int64_t> offsets;
  for (std::size_t i = 0; i < space_.bounds.size(); ++i) {
    offsets.push_back(std::min<std::int64_t>(space_.bounds[i].penalty_beyond(0, known),
                                             largest_sum - unseen_[i]));
  }
  return offsets;
}

void LargestTiles::raise_unseen(const std::vector<std::int64_t>& offsets) {
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    unseen_[i] += offsets[i];
  }
}

template <typename Visit>
void LargestTiles::for_seen(const KnownElements& known, const KnownElements& placed,
                            const Visit& visit) const {
  const std::vector<BoundingBox> reaches = reaches_of(known, space_.turns);
  const std::size_t thetas = space_.turns.size();
  parallel_for(space_.bounds.size() * thetas, [&](std::size_t row) {
    thread_local WindowPlaces places;
    const std::size_t object = row / thetas;
    const std::size_t theta = row % thetas;
    const TileBounds& bounds = space_.bounds[object];
    const TileLevel& level = bounds.levels().front();
    const TileRange seen = seen_tiles(reaches[theta], space_.maps[object], level);
    bounds.place(0, space_.turns[theta], placed, places);
    const std::size_t plane = theta * static_cast<std::size_t>(level.batches_y());
    for (int y = seen.y_first / batch_side; y * batch_side < seen.y_end; ++y) {
      const std::size_t first =
          (plane + static_cast<std::size_t>(y)) * static_cast<std::size_t>(level.batches_x());
      const int x_end = (seen.x_end + batch_side - 1) / batch_side;
      for (int x = seen.x_first / batch_side; x < x_end; x += most_strip) {
        visit({.object = object,
               .first = (first + static_cast<std::size_t>(x)) * batch_tiles,
               .x = x * batch_side,
               .y = y * batch_side,
               .batches = std::min(most_strip, x_end - x),
               .placed = places});
      }
    }
  });
}

std::uint64_t LargestTiles::bytes() const {
  std::uint64_t bytes = 0;
  for (const std::vector<std::int32_t>& sums : sums_) {
    bytes += sums.capacity() * sizeof(std::int32_t);
  }
  for (const std::vector<std::uint32_t>& sums : still_sums_) {
    bytes += sums.capacity() * sizeof(std::uint32_t);
  }
  return bytes;
}

std::vector<BoundingBox> reaches_of(const KnownElements& elements,
                                    std::span<const glm::dvec2> turns) {
  std::vector<BoundingBox> reaches(turns.size());
  for (std::size_t theta = 0; theta < turns.size(); ++theta) {
    const glm::dvec2& turn = turns[theta];
    for (const glm::dvec2& p : elements.from_pivot_mm) {
      reaches[theta].take_in({turn.x * p.x - turn.y * p.y, turn.y * p.x + turn.x * p.y});
    }
  }
  return reaches;
}

TileRange seen_tiles(const BoundingBox& reach, const OccupancyGrid& map, const TileLevel& level) {
  if (reach.empty()) {
    return {};
  }
  // The map fades to the prior within a cell.
  const glm::dvec2 lower_mm = map.origin_mm - map.cell_mm - reach.upper;
  const glm::dvec2 upper_mm =
      map.origin_mm + map.cell_mm * glm::dvec2(map.nx, map.ny) - reach.lower;
  const auto [x_first, x_end] = overlapping(level.x, lower_mm.x, upper_mm.x);
  const auto [y_first, y_end] = overlapping(level.y, lower_mm.y, upper_mm.y);
  return {x_first, std::max(x_first, x_end), y_first, std::max(y_first, y_end)};
}

}  // namespace palpate
