#include "io/hdf5_contents.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

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

/// Asks for the first rows of a dataset, or for another file.
struct Hdf5Request {
  static constexpr std::uint64_t open = UINT64_MAX;

  std::uint64_t dataset;  ///< its index among the names; or `open`
  /// Rows along the first axis; or the length of the path that follows, 0 to open none.
  std::uint64_t size;
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

/// Answers requests, in a child of ForkedChild.
///
/// To Hdf5Request::open, it first sends one record for each named attribute and dataset that
/// exists: its kind, then name, problem, shape, numbers and strings of Hdf5Value, each after its
/// length as a 64-bit integer. Numbers of datasets are left out. A file that cannot be opened gives
/// one record `refused`, whose problem says why. The last record, `end`, has a kind alone.
///
/// It answers every other request with the rows' numbers in row-major order, in pieces: a 64-bit
/// count from 1 to hdf5_piece and as many doubles. A count of 0 means that the rows cannot be read.
///
/// It opens no other file, whatever links and storage this file names.
void serve_hdf5(int socket, const std::vector<std::string>& attributes,
                const std::vector<std::string>& datasets) {
  ForkedSender sender(socket);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);          // a file's filters must not load code
  H5Lunregister(H5L_TYPE_EXTERNAL);  // nor its links open other files, which may be FIFOs
  std::optional<Hdf5Reader> reader;
  const auto open = [&](const std::string& path) {
    allow_cpu_seconds(opening_cpu_seconds);
    allow_memory_bytes(memory_bytes);
    reader.emplace(path, attributes, datasets,
                   Hdf5Confinement{.follows_links = true,
                                   .memory_bytes = allow_memory_bytes,
                                   .cpu_seconds = allow_cpu_seconds});
    if (!reader->problem().empty()) {
      Hdf5Value refused;
      refused.problem = reader->problem();
      send(sender, Hdf5Record::refused, "", refused);
    }
    for (const auto& [name, value] : reader->attributes()) {
      send(sender, Hdf5Record::attribute, name, value);
    }
    for (const auto& [name, value] : reader->datasets()) {
      send(sender, Hdf5Record::dataset, name, value);
    }
    sender.value(Hdf5Record::end);
  };
  for (;;) {
    Hdf5Request request{};
    forked_read(socket, &request, sizeof request);  // ends the child after the last request
    if (request.dataset == Hdf5Request::open) {
      std::string path(request.size, '\0');
      forked_read(socket, path.data(), path.size());
      reader.reset();
      if (!path.empty()) {
        open(path);
      }
    } else {
      const auto send_rows = [&](std::span<const double> numbers) { sender.list(numbers); };
      if (!reader->read(datasets.at(request.dataset), request.size, send_rows)) {
        send_rows({});
      }
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

Hdf5Child::Hdf5Child(const std::vector<std::string>& attributes,
                     const std::vector<std::string>& datasets, std::uint64_t file_bytes)
    : process((initialise_hdf5(), [&](int socket) { serve_hdf5(socket, attributes, datasets); }),
              ForkedLimits{.cpu_seconds = opening_cpu_seconds,
                           .memory_bytes = memory_bytes,
                           .silence = 1min + std::chrono::seconds(file_bytes / bytes_per_second)},
              hdf5_mutex) {}

Hdf5Contents::Hdf5Contents(const std::filesystem::path& path,
                           const std::vector<std::string>& attributes,
                           const std::vector<std::string>& datasets, Hdf5Child* child)
    : path_(path), dataset_names_(datasets), child_(child) {
  const std::uint64_t file_bytes = require_readable(path);
  if (file_bytes == 0) {
    refuse("is empty; copy or record it again");
  }
  // Checked before the file is opened: a file closed by now is read as a whole.
  closed_ = !is_marked_open(path);
  if (!in_children) {
    open_here(attributes, datasets);
    return;
  }
  if (child_ == nullptr) {
    child_ = &own_child_.emplace(attributes, datasets, file_bytes);
  }
  open_in_child();
}

Hdf5Contents::~Hdf5Contents() {
  if (reader_) {
    const ConfinedSession session;
    reader_.reset();
  } else if (!own_child_ && child_->in_step) {
    const Hdf5Request close{Hdf5Request::open, 0};
    child_->process.write(&close, sizeof close);
  }
}

void Hdf5Contents::open_here(const std::vector<std::string>& attributes,
                             const std::vector<std::string>& datasets) {
  const ConfinedSession session;
  reader_ = std::make_unique<Hdf5Reader>(path_, attributes, datasets, Hdf5Confinement{});
  if (!reader_->problem().empty()) {
    refuse("{}", std::exchange(reader_, nullptr)->problem());
  }
  attributes_ = reader_->attributes();
  datasets_.insert(reader_->datasets().begin(), reader_->datasets().end());
}

void Hdf5Contents::open_in_child() {
  child_->in_step = false;
  const std::string& name = path_.native();
  const Hdf5Request request{Hdf5Request::open, name.size()};
  if (!child_->process.write(&request, sizeof request) ||
      !child_->process.write(name.data(), name.size())) {
    refuse_damaged();
  }
  std::string problem;
  for (;;) {
    Hdf5Record kind{};
    std::string field;
    Hdf5Value value;
    if (!child_->process.read(&kind, sizeof kind)) {
      refuse_damaged();
    }
    if (kind == Hdf5Record::end) {
      break;
    }
    if (!child_->process.list(field, memory_bytes) || !receive(child_->process, value)) {
      refuse_damaged();
    }
    if (kind == Hdf5Record::refused) {
      problem = value.problem;
    } else {
      (kind == Hdf5Record::attribute ? attributes_ : datasets_)[field] = std::move(value);
    }
  }
  child_->in_step = true;
  if (!problem.empty()) {
    refuse("{}", problem);
  }
}

void Hdf5Contents::refuse_damaged() const {
  if (child_->process.fell_silent()) {
    throw Error(Fault::system,
                fmt::format("{}: cannot be read: its disk does not answer; copy it to "
                            "another disk",
                            path_.string()));
  }
  refuse("is damaged: the HDF5 library failed on it; copy or record it again");
}

std::string Hdf5Contents::text(const std::string& name) const {
  const Hdf5Value& value = find(attributes_, "attribute", name);
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
  const Hdf5Value& value = find(attributes_, "attribute", name);
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
  const Hdf5Value& value = find(attributes_, "attribute", name);
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
  const Hdf5Value& value = find(datasets_, "dataset", name);
  if (rank && value.shape.size() != *rank) {
    refuse("dataset '{}' has {} dimensions; give it {}", name, value.shape.size(), *rank);
  }
  return value.shape;
}

void Hdf5Contents::read(const std::string& name, const Take& take, std::uint64_t rows) {
  const std::vector<std::uint64_t>& shape = Hdf5Contents::shape(name);
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
  child_->in_step = false;
  if (!child_->process.write(&request, sizeof request)) {
    refuse_damaged();
  }
  const std::vector<std::uint64_t>& shape = Hdf5Contents::shape(name);
  const std::uint64_t row = shape.size() < 2 || shape.back() > hdf5_piece ? 1 : shape.back();
  for (std::uint64_t first = 0; first < total; first += piece.size()) {
    if (!child_->process.list(piece, std::min(hdf5_piece, total - first) * sizeof(double)) ||
        piece.size() % row != 0) {
      refuse_damaged();
    }
    child_->in_step = piece.empty() || first + piece.size() == total;
    if (piece.empty()) {
      refuse("dataset '{}' {}", name, hdf5_damaged);
    }
    take(first, piece);
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

}  // namespace palpate
