#include "io/hdf5_contents.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "io/hdf5_handle.hpp"
#include "io/recording_state.hpp"
#include "io/watched_reading.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

// A file's filters must not load code, nor its links open other files, which may be FIFOs. The
// reader refuses links where libhdf5 has to keep them for others.
class ConfinedSession {
 public:
  explicit ConfinedSession(const std::filesystem::path& path) : mark_(path) {
    H5PLget_loading_state(&plugins_);
    H5PLset_loading_state(0);
    if (is_reading_watched()) {
      H5Lunregister(H5L_TYPE_EXTERNAL);
    }
  }
  ~ConfinedSession() { H5PLset_loading_state(plugins_); }
  ConfinedSession(const ConfinedSession&) = delete;
  ConfinedSession& operator=(const ConfinedSession&) = delete;

 private:
  Hdf5Session session_;
  ReadingMark mark_;
  unsigned plugins_ = 0;
};

}  // namespace

Hdf5Contents::Hdf5Contents(const std::filesystem::path& path,
                           const std::vector<std::string>& attributes,
                           const std::vector<std::string>& datasets)
    : path_(path) {
  if (require_readable(path) == 0) {
    refuse("is empty; copy or record it again");
  }
  if (const std::string fault = fault_known_of(path); !fault.empty()) {
    refuse("{}", fault);
  }
  // Checked before the file is opened: a file closed by now is read as a whole.
  closed_ = !is_marked_open(path);
  const ConfinedSession session(path);
  reader_ = std::make_unique<Hdf5Reader>(path, attributes, datasets, is_reading_watched());
  if (!reader_->problem().empty()) {
    refuse("{}", std::exchange(reader_, nullptr)->problem());
  }
  attributes_ = reader_->attributes();
  datasets_.insert(reader_->datasets().begin(), reader_->datasets().end());
}

Hdf5Contents::~Hdf5Contents() {
  const ConfinedSession session(path_);
  reader_.reset();
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
  if (std::ranges::find(shape, 0) != shape.end() || rows == 0) {
    return;
  }
  std::uint64_t first = 0;
  const ConfinedSession session(path_);
  const auto take_piece = [&](std::span<const double> piece) {
    take(first, piece);
    first += piece.size();
  };
  if (!reader_->read(name, shape.empty() ? 1 : std::min(rows, shape[0]), take_piece)) {
    refuse("dataset '{}' {}", name, hdf5_damaged);
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
