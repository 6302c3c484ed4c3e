#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "file_format.hpp"
#include "hdf5_contents.hpp"
#include "hdf5_writer.hpp"
#include "input_file.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

// What holds for every map, read or about to be written.
void validate(const std::filesystem::path& path, const OccupancyGrid& map) {
  if (const auto fault = fault_of(map)) {
    refuse(path, *fault);
  }
}

}  // namespace

OccupancyGrid read_map(const std::filesystem::path& path) {
  Hdf5Contents file(
      path,
      {"format", "version", "label", "cell_mm", "origin_mm", "prior", "symmetry", "spread_mm"},
      {"log_odds"});
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
  const Hdf5Value& log_odds = file.dataset("log_odds", 2);
  const auto [least, most] = std::minmax(log_odds.shape[0], log_odds.shape[1]);
  if (least < 1 || most > std::numeric_limits<int>::max()) {
    file.refuse(fmt::format("dataset 'log_odds' has the shape {}; store at least one cell",
                            log_odds.shape));
  }
  map.ny = static_cast<int>(log_odds.shape[0]);
  map.nx = static_cast<int>(log_odds.shape[1]);
  map.log_odds.assign(log_odds.numbers.begin(), log_odds.numbers.end());
  validate(path, map);
  return map;
}

void write_map(const std::filesystem::path& path, const OccupancyGrid& map) {
  validate(path, map);
  Hdf5Writer file(path);
  file.attribute("format", map_format);
  file.attribute("version", format_version);
  file.attribute("label", map.label);
  file.attribute("cell_mm", map.cell_mm);
  file.attribute("origin_mm", {map.origin_mm.x, map.origin_mm.y});
  file.attribute("prior", map.prior);
  file.attribute("symmetry", map.symmetry);
  if (map.spread_mm) {
    file.attribute("spread_mm", *map.spread_mm);
  }
  file.dataset("log_odds", {static_cast<std::size_t>(map.ny), static_cast<std::size_t>(map.nx)},
               map.log_odds);
  file.save();
}

}  // namespace palpate
