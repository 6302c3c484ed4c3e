#include "io/hdf5_contents.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "io/available_memory.hpp"
#include "io/hdf5_handle.hpp"
#include "io/recording_state.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

using namespace std::chrono_literals;

// Opening a file takes milliseconds; a child that takes this long loops.
constexpr std::uint64_t opening_cpu_seconds = 2;
// Enough for metadata and a piece of the numbers.
constexpr std::uint64_t memory_bytes = 256 << 20;
// Rate of the slowest disk that is worth waiting for.
constexpr std::uint64_t bytes_per_second = 1 << 20;

std::atomic<bool> in_children{false};

// For HDF5 in this process: a file's filters must not load code.
class ConfinedSession {
 public:
  ConfinedSession() {
    H5PLget_loading_state(&plugins_);
    H5PLset_loading_state(0);
  }
  ~ConfinedSession() { H5PLset_loading_state(plugins_); }
  ConfinedSession(const ConfinedSession&) = delete;
  ConfinedSession& operator=(const ConfinedSession&) = delete;

 private:
  Hdf5Session session_;
  unsigned plugins_ = 0;
};

/// Kinds of records in the first answer of serve_hdf5().
enum class Hdf5Record : char { attribute = 'a', dataset = 'd', refused = 'r', end = 'e' };

/// Asks for the first rows of a dataset.
struct Hdf5Request {
  std::uint64_t dataset;  ///< its index among the names
  std::uint64_t rows;     ///< along the first axis
};

void send(ForkedSender& sender, Hdf5Record kind, const std::string& name, const Hdf5Value& value) {
  sender.value(kind);
  sender.list(name);
  sender.list(value.problem);
  sender.list(value.shape);
  sender.list(value.numbers);
  sender.value(std::uint64_t{value.strings.size()});
  for (const std::string& text : value.strings) {
    sender.list(text);
  }
}

/// Opens the file and answers on the socket, in a child of ForkedChild.
///
/// First it sends one record for each named attribute and dataset that exists: its kind, then name,
/// problem, shape, numbers and strings of Hdf5Value, each after its length as a 64-bit integer.
/// Numbers of datasets are left out. A file that cannot be opened gives one record `refused`, whose
/// problem says why. The last record, `end`, has a kind alone.
///
/// Then it answers each Hdf5Request with the rows' numbers in row-major order, in pieces: a 64-bit
/// count from 1 to hdf5_piece and as many doubles. A count of 0 means that the rows cannot be read.
///
/// It opens no other file, whatever links and storage this file names.
void serve_hdf5(int socket, const std::filesystem::path& path, std::uint64_t file_bytes,
                const std::vector<std::string>& attributes,
                const std::vector<std::string>& datasets) {
  ForkedSender sender(socket);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);          // a file's filters must not load code
  H5Lunregister(H5L_TYPE_EXTERNAL);  // nor its links open other files, which may be FIFOs
  Hdf5Reader reader(path, file_bytes, attributes, datasets,
                    {.follows_links = true,
                     .memory_bytes = allow_memory_bytes,
                     .cpu_seconds = allow_cpu_seconds});
  if (!reader.problem().empty()) {
    Hdf5Value refused;
    refused.problem = reader.problem();
    send(sender, Hdf5Record::refused, "", refused);
    sender.value(Hdf5Record::end);
    sender.flush();
    return;
  }
  for (const auto& [name, value] : reader.attributes()) {
    send(sender, Hdf5Record::attribute, name, value);
  }
  for (const auto& [name, value] : reader.datasets()) {
    send(sender, Hdf5Record::dataset, name, value);
  }
  sender.value(Hdf5Record::end);
  sender.flush();
  for (;;) {
    Hdf5Request request{};
    forked_read(socket, &request, sizeof request);  // ends the child after the last request
    const auto send_rows = [&](std::span<const double> numbers) { sender.list(numbers); };
    if (!reader.read(datasets.at(request.dataset), request.rows, send_rows)) {
      send_rows({});
    }
    sender.flush();
  }
}

// Receives what send() sends after a name; false where the child fails. Nothing is trusted: a
// damaged file may have corrupted the child's memory. No child had the memory for longer lists.
bool receive(ForkedChild& child, Hdf5Value& value) {
  std::uint64_t strings = 0;
  bool intact = child.list(value.problem, memory_bytes) && child.list(value.shape, memory_bytes) &&
                child.list(value.numbers, memory_bytes) && child.read(&strings, sizeof strings);
  for (; intact && strings > 0; --strings) {
    intact = child.list(value.strings.emplace_back(), memory_bytes);
  }
  return intact;
}

}  // namespace

void read_hdf5_in_children(bool wanted) { in_children = wanted; }
bool reads_hdf5_in_children() { return in_children; }

Hdf5Contents::Hdf5Contents(const std::filesystem::path& path,
                           const std::vector<std::string>& attributes,
                           const std::vector<std::string>& datasets)
    : path_(path), dataset_names_(datasets) {
  const std::uint64_t file_bytes = require_readable(path);
  if (file_bytes == 0) {
    refuse("is empty; copy or record it again");
  }
  // Checked before the file is opened: a file closed by now is read as a whole.
  closed_ = !is_marked_open(path);
  if (!in_children) {
    open_here(file_bytes, attributes, datasets);
    return;
  }
  initialise_hdf5();
  child_.emplace(
      [&](int socket) { serve_hdf5(socket, path, file_bytes, attributes, datasets); },
      ForkedLimits{.cpu_seconds = opening_cpu_seconds,
                   .memory_bytes = memory_bytes,
                   .silence = 1min + std::chrono::seconds(file_bytes / bytes_per_second)},
      hdf5_mutex);
  receive();
}

Hdf5Contents::~Hdf5Contents() {
  if (reader_) {
    const ConfinedSession session;
    reader_.reset();
  }
}

void Hdf5Contents::open_here(std::uint64_t file_bytes, const std::vector<std::string>& attributes,
                             const std::vector<std::string>& datasets) {
  std::string problem;
  {
    const ConfinedSession session;
    reader_ =
        std::make_unique<Hdf5Reader>(path_, file_bytes, attributes, datasets, Hdf5Confinement{});
    problem = reader_->problem();
    attributes_ = reader_->attributes();
    for (const auto& [name, value] : reader_->datasets()) {
      datasets_[name] = value;
    }
    if (!problem.empty()) {
      reader_.reset();
    }
  }
  if (!problem.empty()) {
    refuse("{}", problem);
  }
}

void Hdf5Contents::receive() {
  for (;;) {
    Hdf5Record kind{};
    std::string name;
    Hdf5Value value;
    if (!child_->read(&kind, sizeof kind)) {
      refuse_damaged();
    }
    if (kind == Hdf5Record::end) {
      return;
    }
    if (!child_->list(name, memory_bytes) || !palpate::receive(*child_, value)) {
      refuse_damaged();
    }
    if (kind == Hdf5Record::refused) {
      refuse("{}", value.problem);
    }
    (kind == Hdf5Record::attribute ? attributes_ : datasets_)[name] = std::move(value);
  }
}

void Hdf5Contents::refuse_damaged() const {
  if (child_->fell_silent()) {
    throw Error(Fault::system,
                fmt::format("{}: cannot be read: its disk does not answer; copy it to "
                            "another disk",
                            path_.string()));
  }
  refuse("is damaged: the HDF5 library failed on it; copy or record it again");
}

std::string Hdf5Contents::text(const std::string& name) const {
  const Hdf5Value& value = attribute(name);
  if (value.strings.empty() && value.numbers.empty()) {
    return "";
  }
  const std::vector<std::string> all = texts(name);
  if (all.size() != 1) {
    refuse("attribute '{}' has {} strings; store one", name, all.size());
  }
  return all.front();
}

std::vector<std::string> Hdf5Contents::texts(const std::string& name) const {
  const Hdf5Value& value = attribute(name);
  if (value.strings.empty()) {
    refuse("attribute '{}' holds no string; store one", name);
  }
  for (const std::string& text : value.strings) {
    if (!is_printable(text)) {
      refuse("attribute '{}' is not printable UTF-8 text; store it as such", name);
    }
  }
  return value.strings;
}

double Hdf5Contents::number(const std::string& name) const { return numbers(name, 1).front(); }

std::vector<double> Hdf5Contents::numbers(const std::string& name, std::size_t count) const {
  const Hdf5Value& value = attribute(name);
  if (value.numbers.size() != count) {
    refuse("attribute '{}' holds {} numbers; store {}", name, value.numbers.size(), count);
  }
  for (const double number : value.numbers) {
    if (!std::isfinite(number)) {
      refuse("attribute '{}' = {}; store finite numbers", name, number);
    }
  }
  return value.numbers;
}

int Hdf5Contents::integer(const std::string& name, int least) const {
  const double value = number(name);
  if (value != std::floor(value) || value < least || value > std::numeric_limits<int>::max()) {
    refuse("attribute '{}' = {}; store a whole number from {}", name, value, least);
  }
  return static_cast<int>(value);
}

const std::vector<std::uint64_t>& Hdf5Contents::shape(const std::string& name,
                                                      std::optional<std::size_t> rank) const {
  const Hdf5Value& value = dataset(name);
  if (rank && value.shape.size() != *rank) {
    refuse("dataset '{}' has {} dimensions; give it {}", name, value.shape.size(), *rank);
  }
  return value.shape;
}

std::uint64_t Hdf5Contents::count(const std::string& name) const {
  return stored_bytes(shape(name), 1);
}

void Hdf5Contents::read(const std::string& name, const Take& take, std::uint64_t rows) {
  const std::vector<std::uint64_t>& shape = dataset(name).shape;
  std::uint64_t total = 1;
  for (std::size_t axis = 0; axis < shape.size(); ++axis) {
    total *= axis == 0 ? std::min(rows, shape[0]) : shape[axis];
  }
  if (total == 0) {
    return;
  }
  rows = shape.empty() ? 1 : std::min(rows, shape[0]);
  if (reader_) {
    read_here(name, rows, take);
  } else {
    read_from_child(name, rows, total, take);
  }
}

void Hdf5Contents::read_here(const std::string& name, std::uint64_t rows, const Take& take) {
  std::uint64_t first = 0;
  const ConfinedSession session;
  const bool read = reader_->read(name, rows, [&](std::span<const double> piece) {
    take(first, piece);
    first += piece.size();
  });
  if (!read) {
    refuse("dataset '{}' {}", name, hdf5_damaged);
  }
}

void Hdf5Contents::read_from_child(const std::string& name, std::uint64_t rows, std::uint64_t total,
                                   const Take& take) {
  const auto index = std::ranges::find(dataset_names_, name) - dataset_names_.begin();
  const Hdf5Request request{static_cast<std::uint64_t>(index), rows};
  std::vector<double> piece;
  bool intact = child_->write(&request, sizeof request);
  for (std::uint64_t first = 0; intact && first < total; first += piece.size()) {
    std::uint64_t count = 0;
    intact = child_->read(&count, sizeof count);
    if (intact && count == 0) {
      refuse("dataset '{}' {}", name, hdf5_damaged);
    }
    intact = intact && count <= std::min(hdf5_piece, total - first);
    piece.resize(intact ? count : 0);
    intact = intact && child_->read(piece.data(), piece.size() * sizeof(double));
    if (intact) {
      take(first, piece);
    }
  }
  if (!intact) {
    refuse_damaged();
  }
}

const Hdf5Value& Hdf5Contents::find(const std::map<std::string, Hdf5Value>& fields,
                                    const char* kind, const std::string& name) const {
  const auto found = fields.find(name);
  if (found == fields.end()) {
    refuse("{} '{}' is missing; add it", kind, name);
  }
  if (!found->second.problem.empty()) {
    refuse("{} '{}' {}", kind, name, found->second.problem);
  }
  return found->second;
}

const Hdf5Value& Hdf5Contents::attribute(const std::string& name) const {
  return find(attributes_, "attribute", name);
}

const Hdf5Value& Hdf5Contents::dataset(const std::string& name) const {
  return find(datasets_, "dataset", name);
}

}  // namespace palpate
