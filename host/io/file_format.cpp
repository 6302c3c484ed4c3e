#include "io/file_format.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "palpate/files.hpp"

namespace palpate {

namespace {

// Name of a kind of file and the command that takes it.
struct Kind {
  std::string_view format;
  const char* name;
  const char* use;
};

constexpr Kind kinds[] = {
    {recording_format, "recording", "'palpate map' and 'palpate recognize' take it"},
    {map_format, "map", "'palpate recognize' takes it after `maps`"},
    {posterior_format, "posterior", "'palpate info' shows it"},
};

std::string format_of(const Hdf5Contents& file) {
  if (!file.has_attribute("format")) {
    file.refuse(
        "attribute 'format' is missing: this is no Palpate file; give a file whose format "
        "is 'palpate.recording' or 'palpate.map'");
  }
  return file.text("format");
}

const Kind* find_kind(std::string_view format) {
  const Kind* const kind = std::ranges::find(kinds, format, &Kind::format);
  return kind == std::end(kinds) ? nullptr : kind;
}

}  // namespace

int require_format(const Hdf5Contents& file, std::string_view format, int newest) {
  const std::string found = format_of(file);
  if (found != format) {
    const char* wanted = find_kind(format)->name;
    if (const Kind* kind = find_kind(found)) {
      file.refuse("attribute 'format' = '{}': this is a {}, {}; give a {} here", found, kind->name,
                  kind->use, wanted);
    }
    file.refuse("attribute 'format' = '{}' is unknown; give a {} ('{}')", found, wanted, format);
  }
  const int version = file.integer("version", 1);
  if (version > newest) {
    file.refuse(
        "attribute 'version' = {} is newer than this program, which reads {}; update Palpate",
        version, newest);
  }
  return version;
}

void write_format(Hdf5Writer& file, std::string_view format, int version) {
  file.attribute("format", format);
  file.attribute("version", version);
}

void write_head(Hdf5Writer& file, const Recording& head) {
  write_format(file, recording_format);
  file.attribute("object", head.object);
  file.attribute("pressure_unit", head.pressure_unit);
  file.attribute("length_unit", "mm");
  file.attribute("rows", head.rows);
  if (head.truth) {
    const Pose& pose = head.truth->T_object_robot;
    file.attribute("true_object", head.truth->object);
    file.attribute("true_T_object_robot",
                   {pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad});
  }
  if (!head.findings.empty()) {
    auto findings = nlohmann::ordered_json::array();
    for (const SetupFinding& finding : head.findings) {
      findings.push_back({{"what", finding.what},
                          {"nats", finding.nats},
                          {"words", finding.words},
                          {"option", fmt::format("{}", fmt::join(finding.options, ";"))}});
    }
    file.attribute("findings", findings.dump());
  }
  if (!head.sensor.empty()) {
    file.attribute("sensor", head.sensor);
  }
  if (!head.serial.empty()) {
    file.attribute("serial", head.serial);
  }
}

std::string read_format(const std::filesystem::path& path) {
  return format_of(Hdf5Contents(path, {"format"}, {}));
}

}  // namespace palpate
