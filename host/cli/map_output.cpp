#include "cli/map_output.hpp"

#include <fmt/format.h>

#include "cli/options.hpp"
#include "figures/figures.hpp"
#include "palpate/files.hpp"
#include "palpate/object_frame.hpp"

namespace palpate::cli {

namespace {

/// What the map says about the object's symmetry, and what --symmetry to give.
std::string symmetry_words(const OccupancyGrid& map, const RotationalSymmetry& measured) {
  const int n = measured.suggested;
  const std::string given =
      n == map.symmetry || (map.symmetry == 1 && !map.suggested_symmetry) ? ""
      : n == 1 || map.symmetry != 1
          ? fmt::format("; --symmetry {} was given", map.symmetry)
          : fmt::format(
                "; where touches do not tell them apart, recognition takes such turns as equal: "
                "--symmetry {} always, --symmetry 1 never",
                n);
  if (n == 1) {
    return fmt::format("{} looks different after every turn, by {:.2f} mm or more{}", map.label,
                       measured.apart_mm[measured.nearest()], given);
  }
  return fmt::format("{} looks the same after {}, within {:.2f} mm{}", map.label,
                     n == 0 ? "any turn" : fmt::format("every 1/{} of a turn", n),
                     measured.apart_mm[n], given);
}

/// Where the object frame lies.
std::string frame_words(const OccupancyGrid& map) {
  const Pose& frame = map.T_learned_robot_object;
  const bool centred = map.centred_mm != glm::dvec2(0.0);
  if (!centred && frame.translation_mm == glm::dvec2(0.0) && frame.theta_rad == 0.0) {
    return map.drawn ? "is the drawing's" : "is the robot's";
  }
  return fmt::format("lies at x {:.2f} mm, y {:.2f} mm, theta {:.2f} deg in the {} frame{}",
                     frame.translation_mm.x, frame.translation_mm.y, degrees(frame.theta_rad),
                     map.drawn ? "drawing's" : "robot", centred ? ", at the object's middle" : "");
}

}  // namespace

void settle_frame(const ObjectOrigin& origin, OccupancyGrid& map) {
  using Kind = ObjectOrigin::Kind;
  map.T_learned_robot_object = origin.T_learned_robot_object;
  if (origin.kind == Kind::centroid || (origin.kind == Kind::automatic && !holds_origin(map))) {
    centre_frame(map);
  }
}

void make_map_folders(const MapFlags& flags) {
  if (!flags.ros.empty()) {
    make_folder(flags.ros);
  }
  if (flags.to_folder()) {
    make_folder(flags.output);
  }
}

void write_for_ros(const MapFlags& flags, const std::string& name, const OccupancyGrid& map) {
  if (!flags.ros.empty()) {
    const std::filesystem::path yaml = ros_path(flags, name);
    write_map_server(yaml, map);
    fmt::print("{}\n", yaml.string());
  }
}

void write_picture(const MapFlags& flags, const std::string& png) {
  if (!flags.png.empty()) {
    write_file(flags.png, png);
    fmt::print("{}\n", flags.png);
  }
}

void write_maps(const MapFlags& flags, const std::vector<OccupancyGrid>& maps,
                const std::vector<WrittenMap>& written, const std::function<void()>& beside) {
  const std::string picture = flags.png.empty() ? "" : draw_maps(maps);
  make_map_folders(flags);
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const OccupancyGrid& map = maps[i];
    const auto& [path, source, symmetry] = written[i];
    write_map(path, map);
    fmt::print("{}: {} from {}, {} x {} cells of {} mm, prior {:.3g}\n", path.string(), map.label,
               source, map.nx, map.ny, map.cell_mm, map.prior);
    fmt::print("{}: the frame of {} {}\n", path.string(), map.label, frame_words(map));
    if (symmetry) {
      fmt::print("{}: {}\n", path.string(), symmetry_words(map, *symmetry));
    }
    if (const auto sides = map.mirror ? measure_mirror_symmetry(map) : std::nullopt;
        sides && sides->alike()) {
      fmt::print(
          "{}: {} looks the same as its mirror image, within {:.2f} mm: touches cannot tell "
          "its sides apart, and each gets half of the belief; build its map without --mirror\n",
          path.string(), map.label, sides->apart_mm);
    }
  }
  beside();
  for (const OccupancyGrid& map : maps) {
    write_for_ros(flags, map.label, map);
  }
  write_picture(flags, picture);
}

}  // namespace palpate::cli
