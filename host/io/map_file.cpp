#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/available_memory.hpp"
#include "io/file_format.hpp"
#include "io/file_summary.hpp"
#include "io/hdf5_contents.hpp"
#include "io/hdf5_writer.hpp"
#include "io/input_file.hpp"
#include "io/recording_rules.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

void require_sound(const std::filesystem::path& path, const std::optional<std::string>& fault) {
  if (fault) {
    refuse(path, "{}", *fault);
  }
}

/// Opens a map file.
Hdf5Contents open_map(const std::filesystem::path& path) {
  return {path,
          {"format", "version", "label", "cell_mm", "origin_mm", "prior", "symmetry", "spread_mm",
           "suggested_symmetry", "mirror"},
          {"log_odds", "observations", "mean_level"}};
}

/// Reads and checks an open map file, holding a few MB of it at a time.
/// @param head called with the map without cells
/// @param cells called with the log odds in row-major order, in pieces
void scan(const std::filesystem::path& path, Hdf5Contents& file,
          const std::function<void(const OccupancyGrid&)>& head,
          const std::function<void(std::span<const float>)>& cells) {
  require_format(file, map_format);
  OccupancyGrid map;
  map.label = file.text("label");
  map.cell_mm = file.number("cell_mm");
  const std::vector<double> origin = file.numbers("origin_mm", 2);
  map.origin_mm = {origin[0], origin[1]};
  map.prior = file.number("prior");
  map.symmetry = file.integer("symmetry", 0);
  if (file.has_attribute("spread_mm")) {  // other programs' maps may have none
    map.spread_mm = file.number("spread_mm");
  }
  if (file.has_attribute("suggested_symmetry")) {
    map.suggested_symmetry = file.integer("suggested_symmetry", 0);
  }
  map.mirror = file.has_attribute("mirror") && file.integer("mirror", 0) != 0;
  const std::vector<std::uint64_t>& shape = file.shape("log_odds", 2);
  const auto [least, most] = std::minmax(shape[0], shape[1]);
  if (least < 1 || most > std::numeric_limits<int>::max()) {
    file.refuse("dataset 'log_odds' has the shape {}; store at least one cell", shape);
  }
  map.ny = static_cast<int>(shape[0]);
  map.nx = static_cast<int>(shape[1]);
  require_text(path, "attribute 'label'", map.label);
  require_sound(path, fault_without_cells(map));
  head(map);
  std::vector<float> narrow;
  file.read("log_odds", [&](std::uint64_t first, std::span<const double> log_odds) {
    narrow.assign(log_odds.begin(), log_odds.end());
    require_sound(path, fault_of_cells(map, first, narrow));
    cells(narrow);
  });
}

/// Reads numbers that go with the cells, where the file has them.
std::vector<float> read_layer(Hdf5Contents& file, const char* name, const OccupancyGrid& map) {
  if (!file.has_dataset(name)) {
    return {};
  }
  const std::vector<std::uint64_t> cells{static_cast<std::uint64_t>(map.ny),
                                         static_cast<std::uint64_t>(map.nx)};
  if (file.shape(name, 2) != cells) {
    file.refuse("dataset '{}' has the shape {}, 'log_odds' {}; store one number for each cell",
                name, file.shape(name, 2), cells);
  }
  std::vector<float> numbers;
  numbers.reserve(map.log_odds.size());
  file.read(name, [&](std::uint64_t, std::span<const double> part) {
    numbers.insert(numbers.end(), part.begin(), part.end());
  });
  return numbers;
}

}  // namespace

MapSummary summarize_map(const std::filesystem::path& path) {
  MapSummary summary;
  std::optional<Extremes> log_odds;
  Hdf5Contents file = open_map(path);
  scan(
      path, file, [&](const OccupancyGrid& head) { summary.head = head; },
      [&](std::span<const float> cells) {
        for (const float cell : cells) {
          widen(log_odds, cell);
          summary.occupied += cell > 0.0F ? 1 : 0;
        }
      });
  summary.log_odds = log_odds.value();  // no map is without cells
  return summary;
}

OccupancyGrid read_map(const std::filesystem::path& path) {
  Hdf5Contents file = open_map(path);
  OccupancyGrid map;
  scan(
      path, file,
      [&](const OccupancyGrid& head) {
        map = head;
        const auto count = static_cast<std::size_t>(map.nx) * static_cast<std::size_t>(map.ny);
        require_memory(path, fmt::format("a map of {} x {} cells", map.nx, map.ny),
                       count * sizeof(float));
        map.log_odds.reserve(count);
      },
      [&](std::span<const float> cells) {
        map.log_odds.insert(map.log_odds.end(), cells.begin(), cells.end());
      });
  map.observations = read_layer(file, "observations", map);
  map.mean_level = read_layer(file, "mean_level", map);
  require_sound(path, fault_of(map));
  return map;
}

void write_map(const std::filesystem::path& path, const OccupancyGrid& map) {
  require_text(path, "attribute 'label'", map.label);
  require_sound(path, fault_of(map));
  Hdf5Writer file(path);
  write_format(file, map_format);
  file.attribute("label", map.label);
  file.attribute("cell_mm", map.cell_mm);
  file.attribute("origin_mm", {map.origin_mm.x, map.origin_mm.y});
  file.attribute("prior", map.prior);
  file.attribute("symmetry", map.symmetry);
  if (map.spread_mm) {
    file.attribute("spread_mm", *map.spread_mm);
  }
  if (map.mirror) {
    file.attribute("mirror", 1);
  }
  if (map.suggested_symmetry) {
    file.attribute("suggested_symmetry", *map.suggested_symmetry);
  }
  file.dataset("log_odds", {static_cast<std::size_t>(map.ny), static_cast<std::size_t>(map.nx)},
               map.log_odds);
  const std::vector<std::size_t> shape{static_cast<std::size_t>(map.ny),
                                       static_cast<std::size_t>(map.nx)};
  for (const auto& [name, numbers] :
       {std::pair{"observations", &map.observations}, std::pair{"mean_level", &map.mean_level}}) {
    if (!numbers->empty()) {
      file.dataset(name, shape, *numbers);
    }
  }
  file.save();
}

}  // namespace palpate
