#include <yaml-cpp/yaml.h>

#include <fmt/format.h>

#include "io/atomic_file.hpp"
#include "io/input_file.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

// map_server's default thresholds, and the grey levels that its map_saver writes.
constexpr double occupied_threshold = 0.65;
constexpr double free_threshold = 0.196;
constexpr char occupied_grey = 0;
constexpr char free_grey = static_cast<char>(254);
constexpr char unknown_grey = static_cast<char>(205);

std::string image_of(const OccupancyGrid& map) {
  std::string image = fmt::format("P5\n{} {}\n255\n", map.nx, map.ny);
  // Unseen cells hold exactly the prior, which may lie below the free threshold.
  const auto unseen = static_cast<float>(map.prior_log_odds());
  for (int j = map.ny - 1; j >= 0; --j) {
    for (int i = 0; i < map.nx; ++i) {
      const float log_odds = map.at(i, j);
      const double p = probability_from_log_odds(log_odds);
      image += log_odds == unseen       ? unknown_grey
               : p > occupied_threshold ? occupied_grey
               : p < free_threshold     ? free_grey
                                        : unknown_grey;
    }
  }
  return image;
}

}  // namespace

void write_map_server(const std::filesystem::path& yaml_path, const OccupancyGrid& map) {
  if (yaml_path.extension() != ".yaml") {
    refuse(yaml_path, "is not named as a map_server map; end its name in .yaml");
  }
  std::filesystem::path image_path = yaml_path;
  image_path.replace_extension(".pgm");
  constexpr double metres_per_mm = 1e-3;
  // The origin is the corner, not the centre, of the lower left pixel.
  const glm::dvec2 corner_mm = map.origin_mm - 0.5 * map.cell_mm;
  YAML::Emitter image_name;  // in quotes where YAML wants them
  image_name << image_path.filename().string();
  const std::string yaml = fmt::format(
      "image: {}\nmode: trinary\nresolution: {:.12g}\norigin: [{:.12g}, {:.12g}, 0]\nnegate: 0\n"
      "occupied_thresh: {:.12g}\nfree_thresh: {:.12g}\n",
      image_name.c_str(), map.cell_mm * metres_per_mm, corner_mm.x * metres_per_mm,
      corner_mm.y * metres_per_mm, occupied_threshold, free_threshold);

  AtomicFile image_file(image_path);
  AtomicFile yaml_file(yaml_path);
  image_file.write(image_of(map));
  yaml_file.write(yaml);
  // The image first: the YAML that names it must not appear without it.
  image_file.commit();
  yaml_file.commit();
}

}  // namespace palpate
