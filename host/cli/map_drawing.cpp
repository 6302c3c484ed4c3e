#include "cli/map_flags.hpp"

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/options.hpp"
#include "io/drawing_file.hpp"
#include "model/printable.hpp"
#include "streaming/import_steps.hpp"

namespace palpate::cli {

namespace {

/// Throws Error where one of these flags is given.
void require_none(const MapFlags& flags, std::initializer_list<const char*> refused,
                  const char* why) {
  for (const char* flag : refused) {
    if (flags.command->count(flag) > 0) {
      throw Error(Fault::input, fmt::format("{}: {}; leave it out", flag, why));
    }
  }
}

void check_flags(const MapFlags& flags) {
  require_none(flags,
               {"--threshold", "--ratio", "--sensor-model", "--frames", "--touch-sd-mm",
                "--touch-sd-deg", "--group", "--unposed", "--device"},
               "a drawing has no touches");
  for (const std::string& path : flags.recordings) {
    if (!is_drawing(path)) {
      refuse(path, "is no drawing, but {} is; map recordings and drawings one after the other",
             *std::ranges::find_if(flags.recordings, is_drawing));
    }
  }
  if (!flags.occupied.empty() && flags.occupied != "dark" && flags.occupied != "light") {
    refuse_flag("--occupied", flags.occupied, "give dark or light");
  }
  if (flags.recordings.size() > 1 && !flags.label.empty()) {
    refuse_flag("--label", flags.label,
                "names one object, of one drawing; leave it out: several are named by their files");
  }
  if (flags.recordings.size() > 1 && !flags.to_folder()) {
    refuse_flag("-o", flags.output, "{} drawings make as many maps; give a folder, -o {}/",
                flags.recordings.size(), flags.output);
  }
}

/// The options of maps; the prior only where it is given.
DrawnMapOptions options_of(const MapFlags& flags) {
  DrawnMapOptions options;
  options.cell_mm = flags.cell_mm.value_or(options.cell_mm);
  options.spread_mm = flags.spread_mm.value_or(options.spread_mm);
  options.peak = flags.peak.value_or(options.peak);
  options.prior = given_prior(flags).value_or(options.prior);
  options.felt_share = flags.felt_share.value_or(options.felt_share);
  if (!flags.array.empty()) {
    options.reach_mm = array_reach_mm(import_array({.array = flags.array}).elements_mm);
  }
  options.validate();
  return options;
}

/// The label of every drawing, as --label or the file's name says.
std::vector<std::string> labels_of(const MapFlags& flags) {
  std::map<std::string, std::string> files;
  std::vector<std::string> labels;
  for (const std::string& path : flags.recordings) {
    labels.push_back(flags.label.empty() ? printable(std::filesystem::path(path).stem().string())
                                         : flags.label);
    require_name(path, labels.back());
    if (const auto [first, is_new] = files.emplace(labels.back(), path); !is_new) {
      refuse(path, "would be named '{}', as {}; rename one of them", labels.back(), first->second);
    }
  }
  return labels;
}

/// Occupied cells over all cells of maps of equal cells.
double occupied_share(const std::vector<OccupancyGrid>& maps) {
  std::size_t occupied = 0;
  std::size_t all = 0;
  for (const OccupancyGrid& map : maps) {
    occupied += static_cast<std::size_t>(
        std::ranges::count_if(map.log_odds, [](float cell) { return cell > 0.0F; }));
    all += map.log_odds.size();
  }
  return static_cast<double>(occupied) / static_cast<double>(all);
}

}  // namespace

bool MapFlags::of_drawings() const { return std::ranges::any_of(recordings, is_drawing); }

void add_drawing_flags(CLI::App& command, MapFlags& flags) {
  command.add_option("--mm-per-pixel", flags.mm_per_pixel, "Of a drawing, edge of a pixel, mm");
  command.add_option(
      "--occupied", flags.occupied,
      "Of a drawing, whether the object is where it is dark or light [default: dark]");
  command.add_option(
      "--felt-share", flags.felt_share,
      "Of a drawing, the least share of an element's point spread on the object with which the "
      "element feels it; 0.5 leaves outlines where they are drawn [default: 0.2, midway between No "
      "Contact and In Contact, 1.7 spreads outside]");
  command.add_option("--array", flags.array,
                     "Of a drawing, the array that will touch the object, COLUMNS:ROWS:PITCH or a "
                     "file as of import: the map covers what it senses about the outline [default: "
                     "the 6 x 6 DigiTacts region]");
}

void require_no_drawing_flags(const MapFlags& flags) {
  require_none(flags, {"--mm-per-pixel", "--occupied", "--felt-share", "--array"},
               "is of drawings alone");
}

void build_drawn_maps(const MapFlags& flags) {
  check_flags(flags);
  flags.validate();
  const DrawnMapOptions options = options_of(flags);
  const Pose origin = given_origin(flags).value_or(Pose{});
  if (origin.theta_rad != 0.0) {
    refuse_flag("--origin", flags.origin, "a drawing is not turned; give the angle 0");
  }
  const std::vector<std::string> labels = labels_of(flags);
  require_known_symmetries(flags, labels);
  prepare_outputs(flags, labels);

  std::vector<OccupancyGrid> maps;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    Mask mask = read_drawing(flags.recordings[i], {.mm_per_pixel = flags.mm_per_pixel,
                                                   .light = flags.occupied == "light"});
    if (const std::string edges = reached_edges(mask); !edges.empty()) {
      tell_on_stderr(
          fmt::format("{}: the object reaches the picture's edge ({}), and is cut off where it "
                      "goes on beyond; leave {} paper all around it",
                      flags.recordings[i], edges, flags.occupied == "light" ? "dark" : "white"));
    }
    mask.origin_mm -= origin.translation_mm;
    maps.push_back(drawn_map(labels[i], mask, options));
    settle_frame(flags, maps.back());
    maps.back().mirror = flags.mirror;
  }
  const double prior = given_prior(flags).value_or(occupied_share(maps));
  LearnedMaps drawn;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    maps[i].prior = prior;
    const auto symmetry = settle_symmetry(flags, maps[i]);
    drawn.add(flags, std::move(maps[i]), flags.recordings[i], symmetry);
  }
  write_maps(flags, drawn);
}

}  // namespace palpate::cli
