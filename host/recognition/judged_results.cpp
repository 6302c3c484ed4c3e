#include "recognition/judged_results.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

#include <nlohmann/json.hpp>

#include "io/input_file.hpp"

namespace palpate {

namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* remedy = "give what palpate recognize (`json`) or palpate batch wrote";

/// A field that no evaluation reads, but that people look at.
struct ShownField {
  const char* object;  ///< that holds it; "": the record
  const char* key;
  bool (*fits)(const Json& value);
  const char* words;
};

bool is_text(const Json& value) { return value.is_string(); }
bool is_truth(const Json& value) { return value.is_boolean(); }
bool is_count(const Json& value) {
  return value.is_number_unsigned() && value.get<std::uint64_t>() <= 1'000'000'000;
}

constexpr ShownField shown_fields[] = {{"", "recording", is_text, "a name"},
                                       {"", "error", is_text, "a sentence"},
                                       {"", "touches", is_count, "a whole number from 0"},
                                       {"", "unknown", is_count, "a whole number from 0"},
                                       {"", "touch", is_count, "a whole number from 0"},
                                       {"mode", "map", is_text, "a file"},
                                       {"mode", "mirrored", is_truth, "true or false"},
                                       {"fit", "verdict", is_text, "a word"},
                                       {"decision", "act", is_truth, "true or false"}};

constexpr int most_nested = 64;  // a record is copied and written level by level

bool is_nested_within(const Json& value, int levels) {
  return !value.is_structured() ||
         (levels > 0 && std::ranges::all_of(value, [levels](const Json& part) {
            return is_nested_within(part, levels - 1);
          }));
}

/// One record, and the words that name it in a message.
class RecordReader {
 public:
  RecordReader(const fs::path& file, std::size_t index, const Json& record)
      : file_(file), index_(index), record_(record) {
    if (!record.is_object()) {
      refuse(file, "record {} is no JSON object but {}; {}", index, record.type_name(), remedy);
    }
  }

  /// Whether the unknown could not be recognised, which palpate batch tells.
  bool failed() const { return find(record_, "error") != nullptr && !record_.contains("best"); }

  /// None where the true label is not known. The other fields are checked all the same.
  std::optional<JudgedRecord> read() const {
    JudgedRecord judged{.truth = true_label(),
                        .best = text("best", find(record_, "best")),
                        .identity = identity(),
                        .none = probability("none"),
                        .fit_z = fit_z(),
                        .error_mm = error("error_mm"),
                        .refined_error_mm = error("refined_error_mm")};
    if (!judged.identity.contains(judged.best)) {
      refuse_field("best", "'{}' has no probability in 'identity'; {}", judged.best, remedy);
    }
    return judged.truth.empty() ? std::nullopt : std::optional(std::move(judged));
  }

  void require_shown_fields() const {
    if (!is_nested_within(record_, most_nested)) {
      refuse(file_, "record {} is nested more than {} deep; {}", index_, most_nested, remedy);
    }
    for (const auto& [object, key, fits, words] : shown_fields) {
      const bool inside = *object != '\0';
      const Json* of = inside ? find(record_, object) : &record_;
      if (of != nullptr && !of->is_object()) {
        refuse_field(object, "is {}, not an object; {}", of->type_name(), remedy);
      }
      const Json* value = of == nullptr ? nullptr : find(*of, key);
      if (value != nullptr && !fits(*value)) {
        refuse_field(inside ? fmt::format("{}.{}", object, key) : key, "is {}, not {}; {}",
                     value->is_number() ? value->dump() : value->type_name(), words, remedy);
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

  /// The field; null where it is missing or null, as numbers that are not finite are in JSON.
  const Json* find(const Json& object, const char* key) const {
    const auto found = object.find(key);
    return found == object.end() || found->is_null() ? nullptr : &*found;
  }

  std::string text(const char* field, const Json* found) const {
    if (found == nullptr || !found->is_string()) {
      refuse_field(field, "is {}, not a label; {}",
                   found == nullptr ? "missing" : found->type_name(), remedy);
    }
    return found->get<std::string>();
  }

  double number(const std::string& field, const Json& value) const {
    if (!value.is_number()) {
      refuse_field(field, "is {}, not a number; {}", value.type_name(), remedy);
    }
    return value.get<double>();
  }

  double probability(const std::string& field, const Json& value) const {
    constexpr double rounding = 1e-9;  // of a sum over the maps of a label
    const double p = number(field, value);
    if (!(p >= 0.0 && p <= 1.0 + rounding)) {
      refuse_field(field, "= {}, not a probability; give 0 to 1", p);
    }
    return std::min(p, 1.0);
  }

  std::optional<double> probability(const char* key) const {
    const Json* found = find(record_, key);
    return found == nullptr ? std::nullopt : std::optional(probability(key, *found));
  }

  std::string true_label() const {
    const Json* truth = find(record_, "truth");
    if (truth == nullptr) {
      return "";
    }
    if (!truth->is_object()) {
      refuse_field("truth", "is {}, not an object with the true label 'object'; {}",
                   truth->type_name(), remedy);
    }
    return text("truth.object", find(*truth, "object"));
  }

  std::map<std::string, double> identity() const {
    const Json* found = find(record_, "identity");
    if (found == nullptr || !found->is_object()) {
      refuse_field("identity", "is {}, not {{label: probability}}; {}",
                   found == nullptr ? "missing" : found->type_name(), remedy);
    }
    std::map<std::string, double> result;
    double sum = 0.0;
    for (const auto& [label, value] : found->items()) {
      sum += result[label] = probability("identity." + label, value);
    }
    constexpr double tolerance = 0.01;  // of numbers that another program has rounded
    if (!(std::abs(sum - 1.0) <= tolerance)) {
      refuse_field("identity", "sums to {:.6g}; give probabilities that sum to 1", sum);
    }
    return result;
  }

  std::optional<double> fit_z() const {
    const Json* fit = find(record_, "fit");
    if (fit == nullptr) {
      return {};
    }
    if (!fit->is_object()) {
      refuse_field("fit", "is {}, not an object with 'z'; {}", fit->type_name(), remedy);
    }
    const Json* z = find(*fit, "z");
    return z == nullptr ? std::nullopt : std::optional(number("fit.z", *z));
  }

  std::optional<double> error(const char* key) const {
    const Json* found = find(record_, key);
    if (found == nullptr) {
      return {};
    }
    const double error_mm = number(key, *found);
    if (error_mm < 0.0) {
      refuse_field(key, "= {} mm; give at least 0", error_mm);
    }
    return error_mm;
  }

  const fs::path& file_;
  std::size_t index_;
  const Json& record_;
};

/// One JSON value a line; blank lines are passed over.
Json parse_lines(const fs::path& file, std::string_view bytes) {
  Json records = Json::array();
  for (std::size_t line = 1; !bytes.empty(); ++line) {
    const std::string_view text = bytes.substr(0, bytes.find('\n'));
    bytes.remove_prefix(std::min(text.size() + 1, bytes.size()));
    if (text.find_first_not_of(" \t\r") == text.npos) {
      continue;
    }
    records.push_back(Json::parse(text, nullptr, false));
    if (records.back().is_discarded()) {
      refuse(file, "line {} (record {}) is not JSON; {}", line, records.size() - 1, remedy);
    }
  }
  return records;
}

Json parse(const fs::path& file, const std::string& bytes) {
  const bool lines = bytes.find_first_of('{') == bytes.find_first_not_of(" \t\r\n");
  Json json;
  try {
    json = Json::parse(bytes);
  } catch (const Json::parse_error& error) {
    if (lines) {  // a record ends with its line
      return parse_lines(file, bytes);
    }
    refuse(file, "is not JSON at byte {}; {}", error.byte, remedy);
  } catch (const Json::out_of_range&) {
    refuse(file, "holds a number that is too large for JSON; {}", remedy);
  }
  if (json.is_object()) {
    return Json::array({std::move(json)});
  }
  if (!json.is_array()) {
    refuse(file, "holds {}, not an array of records; {}", json.type_name(), remedy);
  }
  return json;
}

std::string read_bytes(const fs::path& file) {
  require_readable(file);
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) {
    refuse(file, "cannot be read; copy it again");
  }
  return bytes;
}

/// The chunks of a folder of palpate batch, which has a task, or the *.json of another one, by
/// name.
std::vector<fs::path> files_of(const fs::path& results) {
  std::error_code error;
  const bool batch = fs::is_regular_file(results / "task.ndjson", error);
  const fs::path folder = batch ? results / "chunks" : results;
  const char* const extension = batch ? ".ndjson" : ".json";
  const fs::directory_iterator entries(folder, error);
  if (error) {
    refuse(folder, "cannot be read: {}; check its permissions", error.message());
  }
  std::vector<fs::path> files;
  for (const auto& entry : entries) {
    if (entry.path().extension() == extension && !entry.is_directory(error)) {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) {
    refuse(folder, "a folder without *{}; {}", extension, remedy);
  }
  std::sort(files.begin(), files.end());
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
  const Json records = parse(file, text);
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

std::vector<Json> records_in(const fs::path& file) {
  const Json records = parse(file, read_bytes(file));
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

std::string failed_words(const JudgedResults& results) {
  return results.failed == 0
             ? ""
             : fmt::format(
                   "{} unknown{} could not be recognised, and left out; their records say why",
                   results.failed, results.failed == 1 ? "" : "s");
}

}  // namespace palpate
