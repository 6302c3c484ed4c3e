#include "driver/serial_profile.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "driver/profile_packet.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

using Entry = YamlEntry;

constexpr const char* suffix = ".yaml";
constexpr std::size_t most_elements = 16384;

bool is_profile_path(const std::string& name) {
  return name.find('/') != std::string::npos || name.ends_with(suffix);
}

std::filesystem::path profile_folder() { return data_folder() / "profiles"; }

std::string text_of(const std::filesystem::path& path) {
  std::error_code failure;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, failure)) {
    file.open(path, std::ios::binary);
  }
  if (!file.is_open()) {
    throw Error(Fault::input,
                fmt::format("{}: cannot be read as a profile; check the path and its permissions",
                            path.string()));
  }
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string read_short_text(const Entry& entry) {
  std::string text = entry.text();
  if (text.size() > 60 ||
      std::any_of(text.begin(), text.end(), [](char c) { return (c & 0x80) != 0; })) {
    entry.refuse("give a text of at most 60 ASCII characters");
  }
  return text;
}

UsbId read_usb_id(const Entry& entry) {
  const std::string text = entry.text();
  const bool in_two = text.size() == 9 && text[4] == ':';
  const auto vendor = in_two ? hexadecimal(text.substr(0, 4)) : std::nullopt;
  const auto product = in_two ? hexadecimal(text.substr(5)) : std::nullopt;
  if (!vendor || !product) {
    entry.refuse("give vendor and product as lsusb shows them, such as 16d0:14cc");
  }
  return {*vendor, *product};
}

SerialLine read_line(const Entry& entry) {
  using Parity = SerialLine::Parity;
  SerialLine line;
  read_keys(entry, {{"baud", whole_number(line.baud, 50, 100'000'000)},
                    {"data_bits", whole_number(line.data_bits, 5, 8)},
                    {"parity",
                     [&](const Entry& e) {
                       line.parity = e.one_of<Parity>(
                           {{"none", Parity::none}, {"odd", Parity::odd}, {"even", Parity::even}});
                     }},
                    {"stop_bits", whole_number(line.stop_bits, 1, 2)}});
  return line;
}

glm::dvec2 read_point(const Entry& entry) {
  constexpr double most_mm = 1e4;
  const std::vector<Entry> xy = entry.list(2, "give [x, y]");
  return {xy[0].number(-most_mm, most_mm), xy[1].number(-most_mm, most_mm)};
}

void append_grid(const Entry& entry, std::vector<glm::dvec2>& elements_mm) {
  std::optional<glm::dvec2> pitch_mm;
  glm::dvec2 center_mm(0.0);
  std::size_t nx = 0;
  std::size_t ny = 0;
  bool x_fastest = true;
  read_keys(entry, {{"grid",
                     [&](const Entry& e) {
                       const std::vector<Entry> counts = e.list(2, "give the counts [x, y]");
                       whole_number(nx, 1, 1024)(counts[0]);
                       whole_number(ny, 1, 1024)(counts[1]);
                     }},
                    {"pitch_mm", [&](const Entry& e) { pitch_mm = read_point(e); }},
                    {"center_mm", [&](const Entry& e) { center_mm = read_point(e); }},
                    {"fastest", [&](const Entry& e) {
                       x_fastest = e.one_of<bool>({{"x", true}, {"y", false}});
                     }}});
  if (nx == 0 || !pitch_mm) {
    entry.refuse("a grid has 'grid: [NX, NY]' and 'pitch_mm: [X, Y]'; add what is missing");
  }
  if (elements_mm.size() + nx * ny > most_elements) {
    entry.refuse(fmt::format("more than {} elements; make the grid smaller", most_elements));
  }
  for (std::size_t i = 0; i < nx * ny; ++i) {
    const glm::dvec2 index = x_fastest ? glm::dvec2(i % nx, i / nx) : glm::dvec2(i / ny, i % ny);
    const glm::dvec2 middle = glm::dvec2(nx - 1, ny - 1) / 2.0;
    elements_mm.push_back(center_mm + (index - middle) * *pitch_mm);
  }
}

std::vector<glm::dvec2> read_elements_mm(const Entry& entry) {
  std::vector<glm::dvec2> elements_mm;
  for (const Entry& item : entry.list("give a list of [x, y] in mm and {grid: ...}")) {
    if (item.node.IsMap()) {
      append_grid(item, elements_mm);
    } else {
      elements_mm.push_back(read_point(item));
    }
  }
  if (elements_mm.empty() || elements_mm.size() > most_elements) {
    entry.refuse(fmt::format("give 1 to {} elements", most_elements));
  }
  return elements_mm;
}

SerialProfile read_root(const Entry& root) {
  SerialProfile profile;
  std::optional<Entry> packet;
  double gain = 1.0;
  double offset = 0.0;
  read_keys(root,
            {{"name", [&](const Entry& e) { profile.name = read_short_text(e); }},
             {"usb",
              [&](const Entry& e) {
                for (const Entry& id : e.list("give a list such as [16d0:14cc]")) {
                  profile.usb.push_back(read_usb_id(id));
                }
              }},
             {"line", [&](const Entry& e) { profile.line = read_line(e); }},
             {"start", [&](const Entry& e) { profile.start = read_bytes(e, 0); }},
             {"stop", [&](const Entry& e) { profile.stop = read_bytes(e, 0); }},
             {"unit",
              [&](const Entry& e) {
                profile.pressure_unit = e.one_of<std::string>({{"raw", "raw"}, {"kPa", "kPa"}});
              }},
             {"gain", [&](const Entry& e) { gain = e.number(-1e12, 1e12); }},
             {"offset", [&](const Entry& e) { offset = e.number(-1e12, 1e12); }},
             {"rate_hz", [&](const Entry& e) { profile.rate_hz = e.number(0.0, 1e6); }},
             {"elements", [&](const Entry& e) { profile.elements_mm = read_elements_mm(e); }},
             {"packet", [&](const Entry& e) { packet.emplace(e); }}});
  for (const auto& [key, missing] :
       {std::pair{"name", profile.name.empty()}, std::pair{"elements", profile.elements_mm.empty()},
        std::pair{"packet", !packet}}) {
    if (missing) {
      root.refuse(fmt::format("key '{}' is missing; add it", key));
    }
  }
  // The packet is read last: it depends on the elements, and keys come in any order.
  profile.packet = read_packet_format(*packet, profile.elements_mm.size());
  profile.packet.gain = gain;
  profile.packet.offset = offset;
  profile.packet.period_s = profile.rate_hz > 0.0 ? 1.0 / profile.rate_hz : 0.0;
  return profile;
}

}  // namespace

std::vector<std::string> shipped_profiles() {
  std::vector<std::string> names;
  std::error_code failure;
  for (const auto& file : std::filesystem::directory_iterator(profile_folder(), failure)) {
    if (file.path().extension() == suffix) {
      names.push_back(file.path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::filesystem::path profile_path(const std::string& name_or_path) {
  return is_profile_path(name_or_path) ? std::filesystem::path(name_or_path)
                                       : profile_folder() / (name_or_path + suffix);
}

SerialProfile read_serial_profile(const std::string& name_or_path) {
  std::vector<std::string> known = shipped_profiles();
  if (!is_profile_path(name_or_path) && std::ranges::find(known, name_or_path) == known.end()) {
    known.insert(known.begin(), takktile_kind);
    throw Error(Fault::input,
                fmt::format("sensor '{}': no such board; give one of {}, or the path of a profile "
                            "that ends in {}",
                            name_or_path, fmt::join(known, ", "), suffix));
  }
  const std::filesystem::path path = profile_path(name_or_path);
  return parse_serial_profile(text_of(path), path);
}

SerialProfile parse_serial_profile(const std::string& yaml, const std::filesystem::path& path) {
  SerialProfile profile;
  read_document(std::istringstream(yaml), path, "the profile",
                [&](const Entry& root) { profile = read_root(root); });
  return profile;
}

}  // namespace palpate
