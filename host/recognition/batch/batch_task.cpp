#include "recognition/batch/batch_task.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <tuple>
#include <utility>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/input_file.hpp"
#include "options/option.hpp"

namespace palpate {

namespace {

using OrderedJson = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr const char* format = "palpate.batch";
constexpr int version = 4;
/// Far more than anyone recognises, and few enough to count and to keep a bit for each.
constexpr std::size_t most_unknowns = 1'000'000'000;

/// The program's texts may hold any bytes, as paths may; JSON must be UTF-8. Each byte becomes the
/// character of its number, so that the text comes back as it was.
std::string to_utf8(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      text += c;
    } else {
      text += static_cast<char>(0xC0 | (byte >> 6));
      text += static_cast<char>(0x80 | (byte & 0x3F));
    }
  }
  return text;
}

std::string from_utf8(const std::string& text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto lead = static_cast<unsigned char>(text[i]);
    if (lead < 0x80 || i + 1 == text.size()) {
      bytes += text[i];
    } else {
      const auto next = static_cast<unsigned char>(text[++i]);
      bytes += static_cast<char>(((lead & 0x03) << 6) | (next & 0x3F));
    }
  }
  return bytes;
}

/// A whole number from 0. @throws OrderedJson::exception where it is none
std::size_t count_of(const OrderedJson& json) {
  return json.get_ref<const OrderedJson::number_unsigned_t&>();
}

BatchTask head_of(const OrderedJson& json) {
  BatchTask task;
  task.program = json.at("program");
  task.chunk_unknowns = std::max<std::size_t>(count_of(json.at("chunk_unknowns")), 1);
  std::map<std::string, std::string> options;
  for (const auto& [option, text] : json.at("options").items()) {
    options[option] = from_utf8(text);
  }
  try {
    task.request = request_with(options);
  } catch (const Error& error) {
    throw OrderedJson::other_error::create(501, error.what(), nullptr);
  }
  for (const OrderedJson& map : json.at("maps")) {
    task.request.maps.push_back(from_utf8(map));
  }
  for (const auto& [file, hash] : json.at("files").items()) {
    task.files[from_utf8(file)] = hash;
  }
  task.inferred = {json.at("pressure_unit"), from_utf8(json.at("unit_from")), json.at("reach_mm")};
  json.at("bins").get_to(task.bins);
  return task;
}

/// What two tasks may be asked differently, as texts.
std::map<std::string, std::string> asked_of(const BatchTask& task) {
  std::map<std::string, std::string> texts = option_texts(task.request);
  texts["chunk"] = fmt::format("{}", task.chunk_unknowns);
  if (!task.request.maps.empty()) {
    texts["maps"] = fmt::format("{}", fmt::join(task.request.maps, " "));
  }
  return texts;
}

std::string value_of(const std::map<std::string, std::string>& texts, const std::string& option) {
  const auto found = texts.find(option);
  return found == texts.end() ? "not given" : fmt::format("'{}'", found->second);
}

/// The first key at which two maps differ; none where they are equal.
template <typename Map>
std::optional<std::string> first_difference(const Map& a, const Map& b) {
  const auto [of_a, of_b] = std::ranges::mismatch(a, b);
  if (of_a == a.end()) {
    return of_b == b.end() ? std::nullopt : std::optional(of_b->first);
  }
  return of_b == b.end() ? of_a->first : std::min(of_a->first, of_b->first);
}

/// Reads the first line of a task file. @throws Error where it is of no task, or of another version
OrderedJson read_head(const fs::path& file, std::istream& stream) {
  std::string line;
  std::getline(stream, line);
  OrderedJson head = OrderedJson::parse(line, nullptr, false);
  if (!head.is_object() || head.value("format", OrderedJson()) != format) {
    refuse(file, "is no task of palpate batch; give another folder");
  }
  if (head.value("version", version) > version) {
    refuse(file, "has version {}, this program reads {}; use a newer palpate",
           head.at("version").get<int>(), version);
  }
  if (head.value("version", version) < version) {
    refuse(file, "is of an older palpate; remove the folder, or give another");
  }
  return head;
}

/// Adding up all touches might overflow.
void require_countable(const fs::path& file, const BatchTask& task) {
  std::size_t left = most_unknowns;
  for (const BatchEntry& entry : task.inputs) {
    const std::size_t unknowns = task.unknowns_of(entry);
    if (unknowns > left) {
      refuse(file, "has more than {} unknowns at {}; give fewer recordings, or another folder",
             most_unknowns, entry.path);
    }
    left -= unknowns;
  }
}

}  // namespace

std::optional<FileStamp> stamp_of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    return {};
  }
  constexpr std::int64_t ns = 1'000'000'000;
  return FileStamp{static_cast<std::uintmax_t>(status.st_size),
                   status.st_mtim.tv_sec * ns + status.st_mtim.tv_nsec};
}

std::size_t BatchTask::unknowns_of(const BatchEntry& entry) const {
  return request.each_frame && entry.survey ? entry.survey->touches : 1;
}

std::size_t BatchTask::unknowns() const {
  std::size_t sum = 0;
  for (const BatchEntry& entry : inputs) {
    sum += unknowns_of(entry);
  }
  return sum;
}

std::size_t BatchTask::chunks() const {
  const std::size_t all = unknowns();
  return all / chunk_unknowns + (all % chunk_unknowns != 0 ? 1 : 0);
}

std::string head_text(const BatchTask& task) {
  OrderedJson maps = OrderedJson::array();
  for (const std::string& map : task.request.maps) {
    maps.push_back(to_utf8(map));
  }
  OrderedJson options = OrderedJson::object();
  for (const auto& [option, text] : option_texts(task.request)) {
    options[option] = to_utf8(text);
  }
  OrderedJson files = OrderedJson::object();
  for (const auto& [file, hash] : task.files) {
    files[to_utf8(file)] = hash;
  }
  const Circumstances& inferred = task.inferred;
  const OrderedJson json{{"format", format},
                         {"version", version},
                         {"program", task.program},
                         {"inputs", task.inputs.size()},
                         {"unknowns", task.unknowns()},
                         {"chunk_unknowns", task.chunk_unknowns},
                         {"maps", maps},
                         {"options", options},
                         {"files", files},
                         {"pressure_unit", inferred.pressure_unit},
                         {"unit_from", to_utf8(inferred.source)},
                         {"reach_mm", inferred.reach_mm},
                         {"bins", task.bins}};
  return json.dump() + "\n";
}

BatchTask head_from(std::string_view text) { return head_of(OrderedJson::parse(text)); }

std::string entry_text(const BatchEntry& entry) {
  OrderedJson json{{"path", to_utf8(entry.path)}};
  if (entry.frames) {
    json["frames"] = OrderedJson::array({entry.frames->begin, entry.frames->end});
  }
  if (!entry.label.empty()) {
    json["label"] = to_utf8(entry.label);
  }
  if (entry.stamp) {
    json["bytes"] = entry.stamp->bytes;
    json["modified_ns"] = entry.stamp->modified_ns;
  }
  if (const auto& survey = entry.survey) {
    json["survey"] = {survey->touches, survey->reach_mm, survey->pressure_unit};
  }
  return json.dump() + "\n";
}

BatchEntry entry_from(std::string_view text) {
  const OrderedJson json = OrderedJson::parse(text);
  BatchEntry entry;
  entry.path = from_utf8(json.at("path"));
  if (json.contains("frames")) {
    entry.frames = Frames{count_of(json.at("frames").at(0)), count_of(json.at("frames").at(1))};
  }
  entry.label = from_utf8(json.value("label", ""));
  if (json.contains("bytes")) {
    entry.stamp = FileStamp{count_of(json.at("bytes")), json.at("modified_ns")};
  }
  if (json.contains("survey")) {
    const OrderedJson& survey = json.at("survey");
    entry.survey = InputSurvey{count_of(survey.at(0)), survey.at(1), survey.at(2)};
  }
  return entry;
}

BatchTask read_batch_task(const fs::path& file) {
  require_readable(file);
  std::ifstream stream(file, std::ios::binary);
  std::string line;
  try {
    const OrderedJson head = read_head(file, stream);
    BatchTask task = head_of(head);
    while (std::getline(stream, line)) {
      task.inputs.push_back(entry_from(line));
    }
    if (task.inputs.size() != head.at("inputs") || stream.bad()) {
      refuse(file, "is cut off; remove the folder, or copy it again");
    }
    require_countable(file, task);
    return task;
  } catch (const OrderedJson::exception&) {
    refuse(file, "is damaged; remove the folder, or copy it again");
  }
}

bool write_batch_task(const fs::path& file, const BatchTask& task) {
  require_countable(file, task);
  AtomicFile target(file, AtomicFile::Links::replaced);
  std::string text = head_text(task);
  constexpr std::size_t piece = 1 << 20;
  for (const BatchEntry& entry : task.inputs) {
    text += entry_text(entry);
    if (text.size() > piece) {
      target.append(text);
      text.clear();
    }
  }
  target.append(text);
  return target.commit_new();
}

std::string difference_of_tasks(const BatchTask& before, const BatchTask& now) {
  if (before.program != now.program) {
    return fmt::format("palpate is {}, its results are of {}", now.program, before.program);
  }
  const auto [old, asked] = std::pair(asked_of(before), asked_of(now));
  if (const auto option = first_difference(old, asked)) {
    return fmt::format("`{}` is {}, but was {} for its results", *option, value_of(asked, *option),
                       value_of(old, *option));
  }
  if (const auto file = first_difference(before.files, now.files)) {
    return fmt::format("{} {}", *file,
                       !now.files.contains(*file)      ? "is no longer used"
                       : !before.files.contains(*file) ? "is new"
                                                       : "has changed");
  }
  return "";
}

std::string difference_of_inputs(const BatchTask& before, const BatchTask& now) {
  const std::size_t both = std::min(before.inputs.size(), now.inputs.size());
  for (std::size_t i = 0; i < both; ++i) {
    const BatchEntry& old = before.inputs[i];
    const BatchEntry& entry = now.inputs[i];
    if (std::tie(old.path, old.frames, old.label) !=
        std::tie(entry.path, entry.frames, entry.label)) {
      return fmt::format("input {} is {}, its results are of {}{}", i, entry.path, old.path,
                         old.path == entry.path ? " with other frames or label" : "");
    }
    if (old.stamp != entry.stamp) {
      return entry.path + (!entry.stamp ? " is gone" : !old.stamp ? " is new" : " has changed");
    }
  }
  return before.inputs.size() == now.inputs.size()
             ? ""
             : fmt::format("{} inputs are given, its results are of {}", now.inputs.size(),
                           before.inputs.size());
}

void refuse_budget(const Request& request) {
  if (request.budget_ms) {
    refuse_option("budget-ms", *request.budget_ms,
                  "its results depend on the clock, and a batch's are the same on every run; leave "
                  "it out, or use palpate recognize");
  }
}

void hash_files(BatchTask& task, const Request& request) {
  task.files.clear();
  for (const auto& [option, file] : files_of(request)) {
    if (!task.files.contains(file.string())) {
      task.files[file.string()] = hash_of_file(file);
    }
  }
}

RecognitionJob job_of(BatchTask& task, const Request& request, DeviceSource device) {
  Circumstances circumstances = task.inferred;
  if (task.bins != std::array<int, 3>{}) {
    circumstances.counts = task.bins;
  }
  RecognitionJob job(request, circumstances, std::move(device));
  const PoseLattice& lattice = job.task().lattice();
  task.bins = {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count};
  return job;
}

}  // namespace palpate
