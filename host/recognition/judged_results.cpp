#include "recognition/judged_results.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "io/input_file.hpp"

namespace palpate {

namespace {

using Parsed = nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* remedy = "give what palpate recognize (`json`) or palpate batch wrote";

bool is_text(const Parsed& value) { return value.is_string(); }
bool is_truth(const Parsed& value) { return value.is_boolean(); }
bool is_number(const Parsed& value) { return value.is_number(); }
bool is_object(const Parsed& value) { return value.is_object(); }
bool is_count(const Parsed& value) {
  return value.is_number_unsigned() && value.get<std::uint64_t>() <= 1'000'000'000;
}

/// What a field must be.
struct FieldKind {
  bool (*fits)(const Parsed& value);
  const char* words;
};
constexpr FieldKind a_label{is_text, "a label"};
constexpr FieldKind a_number{is_number, "a number"};
constexpr FieldKind a_count{is_count, "a whole number from 0"};
constexpr FieldKind a_truth{is_truth, "true or false"};

/// Fields that no evaluation reads, but that people look at.
constexpr std::pair<const char*, FieldKind> shown_fields[] = {{"recording", {is_text, "a name"}},
                                                              {"error", {is_text, "a sentence"}},
                                                              {"touches", a_count},
                                                              {"unknown", a_count},
                                                              {"touch", a_count},
                                                              {"mode.map", {is_text, "a file"}},
                                                              {"mode.mirrored", a_truth},
                                                              {"fit.verdict", {is_text, "a word"}},
                                                              {"decision.act", a_truth}};

constexpr int most_nested = 64;  // a record is copied and written level by level

bool is_nested_within(const Parsed& value, int levels) {
  return !value.is_structured() ||
         (levels > 0 && std::ranges::all_of(value, [levels](const Parsed& part) {
            return is_nested_within(part, levels - 1);
          }));
}

/// One record, and the words that name it in a message.
class RecordReader {
 public:
  RecordReader(const fs::path& file, std::size_t index, const Parsed& record)
      : file_(file), index_(index), record_(record) {
    if (!record.is_object()) {
      refuse(file, "record {} is no JSON object but {}; {}", index, record.type_name(), remedy);
    }
  }

  /// Whether the unknown could not be recognised, which palpate batch tells.
  bool failed() const { return find("error") != nullptr && !record_.contains("best"); }

  /// None where the true label is not known. The other fields are checked all the same.
  std::optional<JudgedRecord> read() const {
    JudgedRecord judged{.truth = find("truth") == nullptr ? "" : text("truth.object"),
                        .best = text("best"),
                        .identity = identity(),
                        .none = {},
                        .fit_z = number("fit.z"),
                        .error_mm = error("error_mm"),
                        .refined_error_mm = error("refined_error_mm")};
    if (const Parsed* none = find("none")) {
      judged.none = probability("none", *none);
    }
    if (!judged.identity.contains(judged.best)) {
      refuse_field("best", "'{}' has no probability in 'identity'; {}", judged.best, remedy);
    }
    return judged.truth.empty() ? std::nullopt : std::optional(std::move(judged));
  }

  void require_shown_fields() const {
    if (!is_nested_within(record_, most_nested)) {
      refuse(file_, "record {} is nested more than {} deep; {}", index_, most_nested, remedy);
    }
    for (const auto& [field, kind] : shown_fields) {
      if (const Parsed* value = find(field)) {
        require(field, value, kind);
      }
    }
  }

 private:
  template <typename... Parts>
  [[noreturn]] void refuse_field(std::string_view field,
                                 fmt::format_string<const Parts&...> message,
                                 const Parts&... parts) const {
    refuse(file_, "record {}: field '{}' {}", index_, field, fmt::format(message, parts...));
  }

  const Parsed& require(const std::string& field, const Parsed* value,
                        const FieldKind& kind) const {
    if (value == nullptr || !kind.fits(*value)) {
      refuse_field(field, "is {}, not {}; {}",
                   value == nullptr     ? "missing"
                   : value->is_number() ? value->dump()
                                        : value->type_name(),
                   kind.words, remedy);
    }
    return *value;
  }

  /// The field, or that of an object in the record, as "fit.z"; null where it is missing or null,
  /// as numbers that are not finite are in JSON.
  const Parsed* find(const std::string& field) const {
    const auto member = [](const Parsed& object, const std::string& key) {
      const auto found = object.find(key);
      return found == object.end() || found->is_null() ? nullptr : &*found;
    };
    const std::size_t dot = field.find('.');
    const std::string outer = field.substr(0, dot);
    const Parsed* found = member(record_, outer);
    return found == nullptr || dot == field.npos
               ? found
               : member(require(outer, found, {is_object, "an object"}), field.substr(dot + 1));
  }

  std::string text(const char* field) const {
    return require(field, find(field), a_label).get<std::string>();
  }

  std::optional<double> number(const char* field) const {
    const Parsed* found = find(field);
    return found == nullptr ? std::nullopt
                            : std::optional(require(field, found, a_number).get<double>());
  }

  double probability(const std::string& field, const Parsed& value) const {
    constexpr double rounding = 1e-9;  // of a sum over the maps of a label
    const auto p = require(field, &value, a_number).get<double>();
    if (!(p >= 0.0 && p <= 1.0 + rounding)) {
      refuse_field(field, "= {}, not a probability; give 0 to 1", p);
    }
    return std::min(p, 1.0);
  }

  std::map<std::string, double> identity() const {
    std::map<std::string, double> result;
    double sum = 0.0;
    const Parsed& found =
        require("identity", find("identity"), {is_object, "{label: probability}"});
    for (const auto& [label, value] : found.items()) {
      sum += result[label] = probability("identity." + label, value);
    }
    constexpr double tolerance = 0.01;  // of numbers that another program has rounded
    if (!(std::abs(sum - 1.0) <= tolerance)) {
      refuse_field("identity", "sums to {:.6g}; give probabilities that sum to 1", sum);
    }
    return result;
  }

  std::optional<double> error(const char* field) const {
    const std::optional<double> error_mm = number(field);
    if (error_mm.value_or(0.0) < 0.0) {
      refuse_field(field, "= {} mm; give at least 0", *error_mm);
    }
    return error_mm;
  }

  const fs::path& file_;
  std::size_t index_;
  const Parsed& record_;
};

/// One JSON value a line; blank lines are passed over.
Parsed parse_lines(const fs::path& file, std::string_view bytes) {
  Parsed records = Parsed::array();
  for (std::size_t line = 1; !bytes.empty(); ++line) {
    const std::string_view text = bytes.substr(0, bytes.find('\n'));
    bytes.remove_prefix(std::min(text.size() + 1, bytes.size()));
    if (text.find_first_not_of(" \t\r") == text.npos) {
      continue;
    }
    records.push_back(Parsed::parse(text, nullptr, false));
    if (records.back().is_discarded()) {
      refuse(file, "line {} (record {}) is not JSON; {}", line, records.size() - 1, remedy);
    }
  }
  return records;
}

Parsed parse(const fs::path& file, const std::string& bytes) {
  const bool lines = bytes.find_first_of('{') == bytes.find_first_not_of(" \t\r\n");
  Parsed json;
  try {
    json = Parsed::parse(bytes);
  } catch (const Parsed::parse_error& error) {
    if (lines) {  // a record ends with its line
      return parse_lines(file, bytes);
    }
    refuse(file, "is not JSON at byte {}; {}", error.byte, remedy);
  } catch (const Parsed::out_of_range&) {
    refuse(file, "holds a number that is too large for JSON; {}", remedy);
  }
  if (json.is_object()) {
    return Parsed::array({std::move(json)});
  }
  if (!json.is_array()) {
    refuse(file, "holds {}, not an array of records; {}", json.type_name(), remedy);
  }
  return json;
}

/// The chunks of a folder of palpate batch, which has a task, or the *.json of another one, by
/// name.
std::vector<fs::path> files_of(const fs::path& results) {
  std::error_code error;
  const bool batch = fs::is_regular_file(results / "task.ndjson", error);
  const fs::path folder = batch ? results / "chunks" : results;
  const char* const extension = batch ? ".ndjson" : ".json";
  std::vector<fs::path> files = paths_in(folder);
  std::erase_if(files, [&](const fs::path& file) {
    return file.extension() != extension || fs::is_directory(file, error);
  });
  if (files.empty()) {
    refuse(folder, "a folder without *{}; {}", extension, remedy);
  }
  return files;
}

}  // namespace

std::vector<fs::path> result_files(std::span<const std::string> arguments) {
  std::vector<fs::path> files;
  std::set<std::optional<FileIdentity>> seen;
  for (const std::string& argument : arguments) {
    std::error_code ignored;
    const std::vector<fs::path> more =
        fs::is_directory(argument, ignored) ? files_of(argument) : std::vector<fs::path>{argument};
    for (const fs::path& file : more) {
      require_readable(file);
      if (!seen.insert(identity_of(file)).second) {
        refuse(file, "given twice; leave one out");
      }
      files.push_back(file);
    }
  }
  return files;
}

void add_records(const fs::path& file, const std::string& text, JudgedResults& results) {
  const Parsed records = parse(file, text);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const RecordReader reader(file, i, records[i]);
    if (reader.failed()) {
      ++results.failed;
    } else if (auto judged = reader.read()) {
      results.records.push_back(std::move(*judged));
    } else {
      ++results.without_truth;
    }
  }
}

std::vector<Parsed> records_in(const fs::path& file) {
  const Parsed records = parse(file, read_bytes(file));
  for (std::size_t i = 0; i < records.size(); ++i) {
    const RecordReader reader(file, i, records[i]);
    reader.require_shown_fields();
    if (!reader.failed() && !records[i].contains("next")) {
      reader.read();
    }
  }
  return records;
}

JudgedResults read_results(std::span<const fs::path> files) {
  JudgedResults results;
  for (const fs::path& file : files) {
    add_records(file, read_bytes(file), results);
  }
  return results;
}

Evaluation evaluate(const JudgedResults& results, const fs::path& source) {
  if (results.records.empty()) {
    refuse(source,
           "none of {} record(s) has a true label ('truth'); name the object in the recordings "
           "before palpate recognize, or give other results",
           results.without_truth);
  }
  return evaluate(results.records);
}

}  // namespace palpate
