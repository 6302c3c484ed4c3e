#include "learning/map_task.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <sstream>
#include <system_error>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/atomic_file.hpp"
#include "io/input_file.hpp"
#include "model/angle_unit.hpp"
#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "options/option.hpp"
#include "palpate/files.hpp"
#include "palpate/occupancy_grid.hpp"
#include "recognition/request.hpp"

namespace palpate {

namespace {

/// The request's symmetry as LABEL=N, by label; a number alone stands under "".
std::map<std::string, int> symmetries_of(const MapRequest& request) {
  std::map<std::string, int> result;
  std::istringstream items(request.symmetry);
  for (std::string item; std::getline(items, item, ',');) {
    const std::size_t equals = item.rfind('=');
    const std::string label = equals == std::string::npos ? "" : item.substr(0, equals);
    const std::string n = equals == std::string::npos ? item : item.substr(equals + 1);
    int turns = 0;
    const auto [rest, error] = std::from_chars(n.data(), n.data() + n.size(), turns);
    const bool plain = n == "0" || (!n.empty() && n.front() >= '1' && n.front() <= '9');
    if (!plain || error != std::errc{} || rest != n.data() + n.size() ||
        (label.empty() && item != request.symmetry) || !result.emplace(label, turns).second) {
      refuse_option(
          "symmetry", request.symmetry,
          "give a whole number from 0, or one for each of some labels, such as nut=6,key=1");
    }
  }
  return result;
}

/// What the map says about the object's symmetry, and what `symmetry` to give.
std::string symmetry_words(const OccupancyGrid& map, const RotationalSymmetry& measured) {
  const int n = measured.suggested;
  const std::string given =
      n == map.symmetry || (map.symmetry == 1 && !map.suggested_symmetry) ? ""
      : n == 1 || map.symmetry != 1
          ? fmt::format("; `symmetry {}` was given", map.symmetry)
          : fmt::format(
                "; where touches do not tell them apart, recognition takes such turns as "
                "equal: `symmetry {}` always, `symmetry 1` never",
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

bool MapRequest::to_folder() const {
  std::error_code ignored;
  return output.empty() || output.ends_with('/') || std::filesystem::is_directory(output, ignored);
}

std::filesystem::path MapRequest::map_file(const std::string& name) const {
  return to_folder() ? std::filesystem::path(output) / (name + ".map.h5")
                     : std::filesystem::path(output);
}

std::filesystem::path MapRequest::sensor_file() const {
  return std::filesystem::path(output) / folder_sensor_name;
}

DisplacementSd MapRequest::touch_sd() const {
  return {shared.touch_sd_mm.value_or(0.0), radians(shared.touch_sd_deg.value_or(0.0))};
}

void MapRequest::validate() const {
  if (!is_printable(label)) {
    refuse_option("label", "give printable text, in UTF-8");
  }
  if (label == none_label) {
    refuse_option("label", none_label,
                  "stands for objects that were never learned; choose another label");
  }
  for (const auto& [option, sd, limit] :
       {std::tuple{"touch-sd-mm", shared.touch_sd_mm, most_length_mm},
        {"touch-sd-deg", shared.touch_sd_deg, 180.0}}) {
    if (sd && !(*sd >= 0.0 && *sd <= limit)) {
      refuse_option(option, *sd, "give 0 to {:g}", limit);
    }
    if (sd && unposed) {
      refuse_option(option, *sd, "presses at unknown poses are placed anyway; leave it out");
    }
  }
  for (const auto& [option, mm] : {std::pair{"cell-mm", cell_mm}, {"spread-mm", spread_mm}}) {
    if (mm && !(*mm >= least_length_mm && *mm <= most_length_mm)) {
      refuse_option(option, *mm, "give {:g} to {:g} mm", least_length_mm, most_length_mm);
    }
  }
  if (peak && !(*peak > 0.0)) {
    refuse_option("peak", *peak, "must be above 0");
  }
  if (peak && *peak >= 1.0) {
    refuse_option("peak", *peak, "must be below 1, or one reading would make a cell certain");
  }
  given_prior(*this);
  given_origin(*this);
  symmetries_of(*this);
  if (max_maps && !unposed) {
    refuse_option("max-maps", *max_maps,
                  "only presses at unknown poses make several maps; give `unposed`, or leave it "
                  "out");
  }
  if (max_maps && *max_maps < 1) {
    refuse_option("max-maps", *max_maps, "give 1 or more");
  }
  if (max_maps && *max_maps > 1 && !to_folder()) {
    refuse_option("max-maps", *max_maps, "several maps need a folder; give `output {}/`", output);
  }
}

std::optional<double> given_prior(const MapRequest& request) {
  if (request.prior.empty() || request.prior == "auto") {
    return {};
  }
  const std::optional<double> prior = number_of(request.prior);
  if (!prior || !(*prior > 0.0 && *prior < 1.0)) {
    refuse_option("prior", request.prior, "give auto, or a probability between 0 and 1");
  }
  return prior;
}

std::optional<Pose> given_origin(const MapRequest& request) {
  const std::string& origin = request.origin;
  if (request.unposed && !origin.empty()) {
    refuse_option("origin", origin,
                  "presses at unknown poses tell of no robot frame; leave it out");
  }
  if (origin.empty() || origin == "auto" || origin == "centroid" || origin == "robot") {
    return {};
  }
  if (std::ranges::count(origin, ',') != 2) {
    refuse_option("origin", origin,
                  "give auto, centroid, robot, or the frame's pose X,Y,DEG in the robot frame, mm "
                  "and degrees");
  }
  return parse_pose("origin", origin);
}

void settle_frame(const MapRequest& request, OccupancyGrid& map) {
  map.T_learned_robot_object = given_origin(request).value_or(Pose{});
  const bool automatic = request.origin.empty() || request.origin == "auto";
  if (request.origin == "centroid" || (automatic && (map.drawn || !holds_origin(map)))) {
    centre_frame(map);
  }
}

void require_known_symmetries(const MapRequest& request, const std::vector<std::string>& labels) {
  for (const auto& [label, n] : symmetries_of(request)) {
    if (!label.empty() && std::ranges::find(labels, label) == labels.end()) {
      refuse_option("symmetry", request.symmetry, "no object is named {}; there {} {}", label,
                    labels.size() == 1 ? "is" : "are", fmt::format("{}", fmt::join(labels, ", ")));
    }
  }
}

std::optional<RotationalSymmetry> settle_symmetry(const MapRequest& request, OccupancyGrid& map) {
  const std::map<std::string, int> given = symmetries_of(request);
  const auto own = given.contains(map.label) ? given.find(map.label) : given.find("");
  const bool none = own != given.end() && own->second == 1;
  map.symmetry = own == given.end() ? 1 : own->second;
  const std::optional<RotationalSymmetry> measured = measure_symmetry(map);
  map.suggested_symmetry = measured && !none ? std::optional(measured->suggested) : std::nullopt;
  return measured;
}

void require_name(const std::string& source, const std::string& label) {
  if (label.empty()) {
    refuse(source, "attribute 'object' is empty; name the object with `label`");
  }
  if (label == none_label) {
    refuse(source,
           "object '{}' stands for objects that were never learned; choose another name with "
           "`label`",
           label);
  }
  if (label.find('/') != std::string::npos) {
    refuse(source,
           "object '{}' holds a '/' and cannot name a file; choose another name with `label`",
           label);
  }
}

void LearnedMaps::add(const MapRequest& request, OccupancyGrid map, const std::string& source,
                      const std::optional<RotationalSymmetry>& symmetry) {
  const std::string file = request.map_file(map.label).string();
  words.push_back(fmt::format("{}: {} from {}, {} x {} cells of {} mm, prior {:.3g}", file,
                              map.label, source, map.nx, map.ny, map.cell_mm, map.prior));
  words.push_back(fmt::format("{}: the frame of {} {}", file, map.label, frame_words(map)));
  if (symmetry) {
    words.push_back(fmt::format("{}: {}", file, symmetry_words(map, *symmetry)));
  }
  if (const auto sides = map.mirror ? measure_mirror_symmetry(map) : std::nullopt;
      sides && sides->alike()) {
    words.push_back(fmt::format(
        "{}: {} looks the same as its mirror image, within {:.2f} mm: touches cannot tell its "
        "sides apart, and each gets half of the belief; build its map without `mirror`",
        file, map.label, sides->apart_mm));
  }
  std::string name = map.label;
  maps.push_back({std::move(name), std::move(map)});
}

void save(const MapRequest& request, const LearnedMaps& learned) {
  if (request.to_folder()) {
    make_folder(request.output);
  }
  for (const auto& [name, map] : learned.maps) {
    write_map(request.map_file(name), map);
  }
  if (learned.sensor) {
    write_sensor_model(request.sensor_file(), *learned.sensor);
  } else if (learned.replaces_sensor) {
    std::error_code ignored;
    std::filesystem::remove(request.sensor_file(), ignored);
  }
}

}  // namespace palpate
