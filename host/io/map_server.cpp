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
  // Numbers are written as text: an Emitter writes them with the locale's decimal commas.
  const auto number = [](double value) { return fmt::format("{:.12g}", value); };
  YAML::Emitter yaml;
  yaml << YAML::BeginMap;
  yaml << YAML::Key << "image" << YAML::Value << image_path.filename().string();
  yaml << YAML::Key << "mode" << YAML::Value << "trinary";
  yaml << YAML::Key << "resolution" << YAML::Value << number(map.cell_mm * metres_per_mm);
  yaml << YAML::Key << "origin" << YAML::Value << YAML::Flow
       << std::vector<std::string>{number(corner_mm.x * metres_per_mm),
                                   number(corner_mm.y * metres_per_mm), number(0.0)};
  yaml << YAML::Key << "negate" << YAML::Value << number(0.0);
  yaml << YAML::Key << "occupied_thresh" << YAML::Value << number(occupied_threshold);
  yaml << YAML::Key << "free_thresh" << YAML::Value << number(free_threshold);
  yaml << YAML::EndMap << YAML::Newline;

  AtomicFile image_file(image_path);
  AtomicFile yaml_file(yaml_path);
  image_file.write(image_of(map));
  yaml_file.write(yaml.c_str());
  // The image first: the YAML that names it must not appear without it.
  image_file.commit();
  yaml_file.commit();
}

}  // namespace palpate
