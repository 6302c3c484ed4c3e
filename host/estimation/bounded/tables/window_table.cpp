#include "estimation/bounded/tables/window_table.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Replaces every number by the least of the `width` numbers from it on, by doubling.
/// @param stride between neighbours; `count` numbers, of which the last width - 1 have no meaning
void slide_minimum(std::vector<std::uint16_t>& numbers, std::size_t stride, int width) {
  int covered = 1;
  while (covered < width) {
    const int step = std::min(covered, width - covered);
    const std::size_t shift = stride * static_cast<std::size_t>(step);
    const std::size_t end = numbers.size() - shift;
    for (std::size_t i = 0; i < end; ++i) {
      numbers[i] = std::min(numbers[i], numbers[i + shift]);
    }
    covered += step;
  }
}

}  // namespace

WindowTable window_table(const SquarePenalties& penalties, int side, int window) {
  WindowTable table{.best = penalties.best,
                    .side = side,
                    .side_log2 = std::countr_zero(static_cast<unsigned>(side)),
                    .columns = 2 * WindowTable::margin + (penalties.nx + side - 1) / side,
                    .rows = 2 * WindowTable::margin + (penalties.ny + side - 1) / side,
                    .beyond = penalties.beyond,
                    .entries = {}};
  // Places in the table are counted in 32 bits.
  const std::int64_t entries = std::int64_t{table.columns} * table.rows * batch_side * side * side;
  if (entries > std::numeric_limits<std::int32_t>::max()) {
    throw Error(Fault::input,
                fmt::format("a map of {} x {} squares is too large for bounds; use PoseHistogram "
                            "(`filter histogram`), or larger cells",
                            penalties.nx, penalties.ny));
  }
  // The squares, with what lies beyond on all sides: windows of the last rows' batches reach
  // batch_side tiles further.
  const std::size_t width = static_cast<std::size_t>(table.columns) * side + side;
  const std::size_t height = static_cast<std::size_t>(table.rows + batch_side) * side;
  const std::size_t before = static_cast<std::size_t>(WindowTable::margin) * side;
  std::vector<std::uint16_t> least(width * height, penalties.beyond);
  for (int j = 0; j < penalties.ny; ++j) {
    const auto row = penalties.least.begin() + static_cast<std::ptrdiff_t>(j) * penalties.nx;
    std::copy(row, row + penalties.nx,
              least.begin() + static_cast<std::ptrdiff_t>((before + j) * width + before));
  }
  slide_minimum(least, 1, window);
  slide_minimum(least, width, window);
  const std::size_t plane = static_cast<std::size_t>(table.columns) * table.rows * batch_side;
  table.entries.resize(plane * side * side);
  auto* entry = table.entries.data();
  for (int phase_y = 0; phase_y < side; ++phase_y) {
    for (int phase_x = 0; phase_x < side; ++phase_x) {
      for (int row = 0; row < table.rows; ++row) {
        const std::uint16_t* from =
            least.data() + (static_cast<std::size_t>(row) * side + phase_y) * width + phase_x;
        for (int column = 0; column < table.columns; ++column, from += side) {
          for (int j = 0; j < batch_side; ++j) {
            *entry++ = from[static_cast<std::size_t>(j) * side * width];
          }
        }
      }
    }
  }
  table.largest = *std::max_element(table.entries.begin(), table.entries.end());
  return table;
}

ChangeTable change_table(const WindowTable* to, const WindowTable& from) {
  const auto penalty_at = [to](std::size_t i) { return to == nullptr ? 0 : int{to->entries[i]}; };
  int offset = 0;
  for (std::size_t i = 0; i < from.entries.size(); ++i) {
    offset = std::max(offset, from.entries[i] - penalty_at(i));
  }
  ChangeTable change{.table = from, .offset = static_cast<std::uint16_t>(offset)};
  for (std::size_t i = 0; i < from.entries.size(); ++i) {
    change.table.entries[i] = static_cast<std::uint16_t>(penalty_at(i) - from.entries[i] + offset);
  }
  const int beyond = (to == nullptr ? 0 : int{to->beyond}) - from.beyond;
  change.table.beyond = static_cast<std::uint16_t>(beyond + offset);
  const auto& entries = change.table.entries;
  change.table.largest = *std::max_element(entries.begin(), entries.end());
  return change;
}

}  // namespace palpate
