#include "yaml/yaml_entry.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Counted from 1, also where there is no mark, as in an empty file.
int line_of(const YAML::Mark& mark) { return std::max(mark.line, 0) + 1; }

/// Notes where a document begins.
struct DocumentStart : YAML::EventHandler {
  void OnDocumentStart(const YAML::Mark& mark) override { at = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

  YAML::Mark at;
};

}  // namespace

void read_document(std::istream&& yaml, const std::filesystem::path& file, const std::string& key,
                   const std::function<void(const YamlEntry&)>& read) {
  const std::string text(std::istreambuf_iterator<char>(yaml), {});
  try {
    const YAML::Node document = YAML::Load(text);
    // YAML::LoadAll() finds documents without end in some text that is no YAML. Most text has no
    // marker between documents, which UTF-16 would hide, and is not parsed again.
    const auto holds = [&](std::string_view part) { return text.find(part) != std::string::npos; };
    DocumentStart second;
    std::istringstream again(text);
    YAML::Parser parser(again);
    if ((holds("---") || holds("...") || holds({"\0", 1})) && parser.HandleNextDocument(second) &&
        parser.HandleNextDocument(second)) {
      throw Error(Fault::input,
                  fmt::format("{}: line {}: a second document, of which nothing would "
                              "be read; leave one, without --- after it",
                              file.string(), line_of(second.at)));
    }
    read({file, key, document});
  } catch (const YAML::Exception& error) {
    throw Error(Fault::input, fmt::format("{}: line {}: {}; correct the YAML", file.string(),
                                          line_of(error.mark), printable(error.msg)));
  }
}

void YamlEntry::refuse(std::string_view remedy) const {
  // A message stays one short line whatever the file holds.
  const bool shown = node.IsScalar() && node.Scalar().size() <= 60 && is_printable(node.Scalar());
  throw Error(Fault::input,
              fmt::format("{}: line {}: '{}'{}: {}", file.string(), line_of(node.Mark()), key,
                          shown ? fmt::format(" = '{}'", node.Scalar()) : "", remedy));
}

std::string YamlEntry::text() const {
  if (!node.IsScalar() || node.Scalar().empty() || !is_printable(node.Scalar())) {
    refuse("give a text");
  }
  return node.Scalar();
}

double YamlEntry::number(const std::function<bool(double)>& fits, std::string_view remedy) const {
  // yaml-cpp's own conversion reads 1.500 as 1500 where the locale has decimal commas.
  const std::optional<double> value = node.IsScalar() ? number_of(node.Scalar()) : std::nullopt;
  if (!value || !fits(*value)) {
    refuse(remedy);
  }
  return *value;
}

double YamlEntry::number(double least, double upper_bound) const {
  return number([&](double value) { return value >= least && value <= upper_bound; },
                fmt::format("give a number from {:g} to {:g}", least, upper_bound));
}

double YamlEntry::number() const {
  return number([](double) { return true; }, "give a number");
}

std::int64_t YamlEntry::whole_number(std::int64_t least, std::int64_t upper_bound,
                                     Digits digits) const {
  // yaml-cpp's own conversion reads 010 as 8.
  const std::string text = node.IsScalar() ? node.Scalar() : "";
  const bool hexadecimal = digits == Digits::also_hexadecimal && text.starts_with("0x") &&
                           text.find_first_of("+-") == std::string::npos;
  const std::optional<std::int64_t> value =
      hexadecimal ? whole_number_of(text.substr(2), 16) : whole_number_of(text);
  if (!value || *value < least || *value > upper_bound) {
    refuse(fmt::format("give a whole number from {} to {}", least, upper_bound));
  }
  return *value;
}

std::vector<YamlEntry> YamlEntry::list(std::string_view remedy) const {
  if (!node.IsSequence()) {
    refuse(remedy);
  }
  std::vector<YamlEntry> entries;
  for (const YAML::Node& item : node) {
    entries.push_back({file, fmt::format("{}[{}]", key, entries.size()), item});
  }
  return entries;
}

std::vector<YamlEntry> YamlEntry::list(std::size_t count, std::string_view remedy) const {
  std::vector<YamlEntry> entries = list(remedy);
  if (entries.size() != count) {
    refuse(remedy);
  }
  return entries;
}

void read_keys(const YamlEntry& map, const YamlKeys& readers) {
  std::string known;
  for (const auto& [key, reader] : readers) {
    known += fmt::format("{}{}", known.empty() ? "" : ", ", key);
  }
  if (!map.node.IsMap()) {
    map.refuse(fmt::format("give a map with keys out of {}", known));
  }
  std::set<std::string_view> seen;
  for (const auto& item : map.node) {
    const YamlEntry name{map.file, "key", item.first};
    const auto found = std::find_if(readers.begin(), readers.end(), [&](const auto& entry) {
      return item.first.IsScalar() && entry.first == item.first.Scalar();
    });
    if (found == readers.end()) {
      name.refuse(fmt::format("unknown key; the keys are {}", known));
    }
    if (!seen.insert(found->first).second) {
      name.refuse("key given twice; remove one");
    }
    found->second({map.file, std::string(found->first), item.second});
  }
}

}  // namespace palpate
