#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cli/map_flags.hpp"
#include "cli/map_output.hpp"
#include "cli/map_sensor.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "figures/figures.hpp"
#include "learning/contact_learning.hpp"
#include "learning/unposed_maps.hpp"
#include "palpate/files.hpp"
#include "recognition/folder_sensor.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

/// Where a folder is written, the maps that four times the cost in recognition buys.
constexpr int usual_maps = 4;

/// The maps of one object, with what is needed to tell about them.
struct Object {
  const ObjectTouches* presses = nullptr;
  const std::vector<TouchSource>* sources = nullptr;
  UnposedMaps maps;
};

int most_maps(const MapFlags& flags) {
  const int most = flags.max_maps.value_or(flags.to_folder() ? usual_maps : 1);
  if (most < 1) {
    refuse_flag("--max-maps", most, "give 1 or more");
  }
  if (most > 1 && !flags.to_folder()) {
    refuse_flag("--max-maps", most, "several maps need a folder; give -o {}/", flags.output);
  }
  return most;
}

/// The name of a map's files, of `count` maps of the label.
std::string name_of(const std::string& label, std::size_t map, std::size_t count) {
  return count == 1 ? label : fmt::format("{}.{}", label, map + 1);
}

/// The files that the maps may have.
std::vector<std::filesystem::path> prepare_unposed_outputs(const MapFlags& flags,
                                                           const GroupedTouches& grouped,
                                                           std::size_t most, bool learns) {
  std::vector<std::string> names;
  for (const ObjectTouches& object : grouped.objects) {
    names.push_back(object.label);
    for (std::size_t map = 0; flags.to_folder() && map < most; ++map) {
      names.push_back(name_of(object.label, map, most + 1));
    }
  }
  std::vector<std::filesystem::path> paths;
  for (const std::string& name : names) {
    paths.push_back(map_path(flags, name));
  }
  std::vector<std::filesystem::path> outputs = paths;
  if (learns) {
    outputs.push_back(sensor_file(flags));
  }
  prepare_outputs(flags, outputs, names);
  return paths;
}

UnposedOptions unposed_options(const MapFlags& flags, const std::vector<Recording>& recordings,
                               const std::optional<LearnedSensor>& sensor,
                               const GroupedTouches& grouped) {
  UnposedOptions result;
  result.map = map_options(flags, recordings, sensor);
  std::vector<Touch> all;
  for (const ObjectTouches& object : grouped.objects) {
    all.insert(all.end(), object.touches.begin(), object.touches.end());
  }
  double pitch_mm = 0.0;
  try {
    pitch_mm = element_pitch_mm(all);
  } catch (const Error& error) {
    refuse(recordings.front().path, "{}", error.what());
  }
  if (!flags.cell_given) {
    result.map.cell_mm = 0.5 * pitch_mm;
  }
  if (!sensor && !flags.spread_mm) {
    constexpr double of_pitch = 0.6;  // leaves no gaps between the elements of a press
    result.map.sensor.spread_mm = of_pitch * pitch_mm;
  }
  result.map.sensor.prior =
      given_prior(flags, sensor).value_or(share_in_contact(all, result.map.classifier));
  result.contact.classifier = result.map.classifier;
  result.contact.prior = result.map.sensor.prior;
  result.most_maps = static_cast<std::size_t>(most_maps(flags));
  result.mirror = flags.mirror;
  if (sensor) {
    result.contact.gamma = sensor->gamma;
    result.temperature = sensor->temperature;
  }
  return result;
}

/// Sets the learned table of the object, or else that of all objects.
void use_table(const std::optional<LearnedSensor>& sensor, const std::string& label,
               UnposedOptions& options) {
  if (sensor && sensor->table) {
    const auto own = sensor->table->objects.find(label);
    options.contact.table = table_of(
        *sensor->table, own == sensor->table->objects.end() ? sensor->table->shared : own->second);
    options.layer = sensor->table->layer;
  }
}

std::string fit_words(const UnposedMap& map) {
  double least = 1.0;
  double sum = 0.0;
  for (const PlacedPress& press : map.presses) {
    if (!press.fit) {
      return "a press that fits no other";
    }
    least = std::min(least, *press.fit);
    sum += *press.fit;
  }
  return fmt::format("{} presses that fit by {:.2f} on average, {:.2f} at least",
                     map.presses.size(), sum / static_cast<double>(map.presses.size()), least);
}

std::string words_of(const Misfit& misfit) {
  switch (misfit.reason) {
    case Misfit::Reason::no_contact:
      return "nothing is in contact";
    case Misfit::Reason::too_little:
      return "too little is in contact";
    case Misfit::Reason::unlike:
      break;
  }
  return fmt::format("fits no map ({:.2f})", misfit.fit);
}

std::string draw(const std::vector<Object>& objects) {
  std::vector<OccupancyGrid> maps;
  for (const Object& object : objects) {
    for (std::size_t m = 0; m < object.maps.maps.size(); ++m) {
      maps.push_back(object.maps.maps[m].map);
      maps.back().label = name_of(object.presses->label, m, object.maps.maps.size());
    }
  }
  return draw_maps(maps);
}

/// Says which older maps of the label `recognize` would read besides the new ones.
void warn_of_older_maps(const MapFlags& flags, const std::string& label, std::size_t count) {
  const auto warn = [&](const std::string& name) {
    std::error_code ignored;
    const std::filesystem::path path = map_path(flags, name);
    if (std::filesystem::exists(path, ignored)) {
      fmt::print(stderr,
                 "palpate: {}: an older map of '{}'; remove it, or --maps {} reads it, too\n",
                 path.string(), label, flags.output);
      return true;
    }
    return false;
  };
  if (count > 1) {
    warn(label);
  }
  for (std::size_t map = count == 1 ? 0 : count; warn(name_of(label, map, map + 2)); ++map) {
  }
}

void write_object(const MapFlags& flags, const Object& object) {
  const std::size_t count = object.maps.maps.size();
  const std::string& label = object.presses->label;
  for (std::size_t m = 0; m < count; ++m) {
    const UnposedMap& one = object.maps.maps[m];
    const std::filesystem::path path = map_path(flags, name_of(label, m, count));
    write_map(path, one.map);
    fmt::print("{}: {} from {}; {} x {} cells of {:.4g} mm, prior {:.3g}\n", path.string(), label,
               fit_words(one), one.map.nx, one.map.ny, one.map.cell_mm, one.map.prior);
    write_for_ros(flags, name_of(label, m, count), one.map);
    for (const PlacedPress& press : one.presses) {
      if (press.fit && *press.fit < doubtful_fit) {
        const TouchSource& source = (*object.sources)[press.press];
        fmt::print("{}: press {} fits {} by only {:.2f}\n", source.path, source.index,
                   path.string(), *press.fit);
      }
    }
  }
  for (const Misfit& misfit : object.maps.misfits) {
    const TouchSource& source = (*object.sources)[misfit.press];
    fmt::print("{}: press {} left out: {}\n", source.path, source.index, words_of(misfit));
  }
  if (!object.maps.settled) {
    fmt::print("{}: presses still moved after {} rounds; look at the maps\n", label,
               object.maps.rounds);
  }
  if (flags.to_folder()) {
    warn_of_older_maps(flags, label, count);
  }
}

}  // namespace

void build_unposed_maps(const MapFlags& flags) {
  const int most = most_maps(flags);
  const std::vector<Recording> recordings = read_touch_recordings(flags.recordings);
  std::optional<LearnedSensor> sensor = sensor_of(flags, recordings);
  const bool learns = learns_sensor(flags);
  // What a flag may be refused for comes before what takes long.
  const LearnedSensor any{.pressure_unit = recordings.front().pressure_unit};
  const GroupedTouches grouped = group_by_label(
      flags, recordings, map_options(flags, recordings, learns ? any : sensor).classifier);
  const std::vector<std::filesystem::path> may_write =
      prepare_unposed_outputs(flags, grouped, static_cast<std::size_t>(most), learns);
  MapSensor learned;
  if (learns) {
    learned = learn_unposed_sensor(flags, recordings, may_write);
    sensor = learned.sensor;
  }
  UnposedOptions options = unposed_options(flags, recordings, sensor, grouped);

  std::vector<Object> objects;
  {
    Progress progress("placing presses");
    const auto count = static_cast<double>(grouped.objects.size());
    for (std::size_t k = 0; k < grouped.objects.size(); ++k) {
      const ObjectTouches& object = grouped.objects[k];
      use_table(sensor, object.label, options);
      const auto show = [&](double fraction) {
        progress.show((static_cast<double>(k) + fraction) / count);
      };
      objects.push_back({&object, &grouped.sources[k],
                         unposed_maps(object.touches, object.label, options, show)});
      for (UnposedMap& map : objects.back().maps.maps) {
        settle_symmetry(flags, map.map);
      }
    }
  }
  const std::string picture = flags.png.empty() ? "" : draw(objects);

  make_map_folders(flags);
  for (const Object& object : objects) {
    write_object(flags, object);
    for (std::size_t m = 0; learned.sensor && m < object.maps.maps.size(); ++m) {
      const std::string name = name_of(object.presses->label, m, object.maps.maps.size());
      learned.sensor->maps[map_path(flags, name).filename().string()] =
          digest_of(object.maps.maps[m].map);
    }
  }
  if (learns) {
    write_sensor(flags, learned);
  }
  write_picture(flags, picture);
}

}  // namespace palpate::cli
