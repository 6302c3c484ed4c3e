#include "io/hdf5_contents.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "io/hdf5_child.hpp"
#include "io/hdf5_handle.hpp"
#include "io/hdf5_rows.hpp"
#include "io/recording_state.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

using namespace std::chrono_literals;

// Opening a file takes milliseconds; a child that takes this long loops.
constexpr std::uint64_t cpu_seconds = 2;
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

// Parses the first answer of serve_hdf5(). Nothing in the answer is trusted: a damaged file may
// have corrupted the child's memory. Once a length does not fit, every further value is empty.
class Receiver {
 public:
  explicit Receiver(ForkedChild& child) : child_(child) {}

  bool intact() const { return intact_; }

  Hdf5Record kind() {
    Hdf5Record value{};
    copy(&value, sizeof value);
    return value;
  }

  template <class List>
  void list(List& values) {
    constexpr std::size_t width = sizeof(typename List::value_type);
    const std::uint64_t count = size();
    // No child had the memory for more.
    if (count > memory_bytes / width) {
      intact_ = false;
      return;
    }
    values.resize(count);
    copy(values.data(), count * width);
  }

  void value(Hdf5Value& value) {
    list(value.problem);
    list(value.shape);
    list(value.numbers);
    for (std::uint64_t left = size(); left > 0 && intact_; --left) {
      list(value.strings.emplace_back());
    }
  }

 private:
  std::uint64_t size() {
    std::uint64_t value = 0;
    copy(&value, sizeof value);
    return value;
  }

  void copy(void* values, std::size_t bytes) {
    intact_ = intact_ && child_.read(values, bytes);
    if (!intact_) {
      std::fill_n(static_cast<char*>(values), bytes, '\0');
    }
  }

  ForkedChild& child_;
  bool intact_ = true;
};

}  // namespace

void read_hdf5_in_children(bool wanted) { in_children = wanted; }
bool reads_hdf5_in_children() { return in_children; }

Hdf5Contents::Hdf5Contents(const std::filesystem::path& path,
                           const std::vector<std::string>& attributes,
                           const std::vector<std::string>& datasets)
    : path_(path) {
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
      ForkedLimits{.cpu_seconds = cpu_seconds,
                   .memory_bytes = memory_bytes,
                   .silence = 1min + std::chrono::seconds(file_bytes / bytes_per_second)},
      hdf5_mutex);
  receive(datasets);
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
      datasets_[name] = {value};
    }
    if (!problem.empty()) {
      reader_.reset();
    }
  }
  if (!problem.empty()) {
    refuse("{}", problem);
  }
}

void Hdf5Contents::receive(const std::vector<std::string>& datasets) {
  Receiver receiver(*child_);
  for (;;) {
    const Hdf5Record kind = receiver.kind();
    if (kind == Hdf5Record::end && receiver.intact()) {
      return;
    }
    std::string name;
    Hdf5Value value;
    receiver.list(name);
    receiver.value(value);
    if (!receiver.intact()) {
      refuse_damaged();
    }
    if (kind == Hdf5Record::refused) {
      refuse("{}", value.problem);
    }
    if (kind == Hdf5Record::attribute) {
      attributes_[name] = std::move(value);
      continue;
    }
    const auto found = std::find(datasets.begin(), datasets.end(), name);
    if (found == datasets.end()) {
      refuse_damaged();
    }
    datasets_[name] = {std::move(value), static_cast<std::uint64_t>(found - datasets.begin())};
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
  return hdf5_stored_bytes(shape(name), 1);
}

void Hdf5Contents::read(const std::string& name, const Take& take, std::uint64_t rows) {
  const Dataset& found = dataset(name);
  const std::vector<std::uint64_t>& shape = found.shape;
  std::uint64_t total = 1;
  for (std::size_t axis = 0; axis < shape.size(); ++axis) {
    total *= axis == 0 ? std::min(rows, shape[0]) : shape[axis];
  }
  if (total == 0) {
    return;
  }
  const Hdf5Request request{found.index, 0, shape.empty() ? 1 : std::min(rows, shape[0])};
  if (reader_) {
    read_here(name, request.count, take);
  } else {
    read_from_child(request, name, total, take);
  }
}

void Hdf5Contents::read_here(const std::string& name, std::uint64_t rows, const Take& take) {
  std::uint64_t first = 0;
  const ConfinedSession session;
  const bool read = reader_->read(name, 0, rows, [&](std::span<const double> piece) {
    take(first, piece);
    first += piece.size();
  });
  if (!read) {
    refuse("dataset '{}' {}", name, hdf5_damaged);
  }
}

void Hdf5Contents::read_from_child(const Hdf5Request& request, const std::string& name,
                                   std::uint64_t total, const Take& take) {
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

template <typename Field>
const Field& Hdf5Contents::find(const std::map<std::string, Field>& fields, const char* kind,
                                const std::string& name) const {
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

const Hdf5Contents::Dataset& Hdf5Contents::dataset(const std::string& name) const {
  return find(datasets_, "dataset", name);
}

}  // namespace palpate
