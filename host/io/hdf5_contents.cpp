#include "hdf5_contents.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>

#include <fmt/format.h>

#include "forked_call.hpp"
#include "hdf5_child.hpp"
#include "hdf5_handle.hpp"
#include "input_file.hpp"

namespace palpate {

namespace {

// Takes the stream of send_hdf5_values() apart. Nothing in it is trusted: a damaged file may have
// corrupted the child's memory. Once a length does not fit, every further value is empty.
class Receiver {
 public:
  explicit Receiver(std::string_view stream) : rest_(stream) {}

  bool intact() const { return intact_; }
  bool empty() const { return rest_.empty(); }

  Hdf5Record kind() {
    Hdf5Record value{};
    copy(&value, 1, sizeof value);
    return value;
  }

  template <class List>
  void list(List& values) {
    constexpr std::size_t width = sizeof(typename List::value_type);
    const std::uint64_t count = size();
    if (count > rest_.size() / width) {
      intact_ = false;
      return;
    }
    values.resize(count);
    copy(values.data(), count, width);
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
    copy(&value, 1, sizeof value);
    return value;
  }

  void copy(void* values, std::size_t count, std::size_t width) {
    if (!intact_ || count > rest_.size() / width) {
      intact_ = false;
      return;
    }
    if (count > 0) {
      std::memcpy(values, rest_.data(), count * width);
      rest_.remove_prefix(count * width);
    }
  }

  std::string_view rest_;
  bool intact_ = true;
};

// Milliseconds are usual; a child that needs this long loops.
constexpr std::uint64_t cpu_seconds = 2;
constexpr std::uint64_t cpu_bytes_per_second = 1 << 20;
// Metadata, and bytes that were compressed as far as can be and widen to double.
constexpr std::uint64_t memory_bytes = 256 << 20;
constexpr std::uint64_t memory_bytes_per_byte = largest_compression * sizeof(double);

}  // namespace

Hdf5Contents::Hdf5Contents(const std::filesystem::path& path,
                           const std::vector<std::string>& attributes,
                           const std::vector<std::string>& datasets)
    : path_(path) {
  const std::uint64_t file_bytes = require_readable(path);
  if (file_bytes == 0) {
    refuse("is empty; copy or record it again");
  }
  std::string stream;
  {
    const std::lock_guard lock(hdf5_mutex);
    stream = forked_call(
        [&](int descriptor) {
          send_hdf5_values(descriptor, path, file_bytes, attributes, datasets);
        },
        {.cpu_seconds = cpu_seconds + file_bytes / cpu_bytes_per_second,
         .memory_bytes = memory_bytes + memory_bytes_per_byte * file_bytes});
  }
  Receiver receiver(stream);
  for (;;) {
    const Hdf5Record kind = receiver.kind();
    if (kind == Hdf5Record::end && receiver.intact() && receiver.empty()) {
      return;
    }
    std::string name;
    Hdf5Value value;
    receiver.list(name);
    receiver.value(value);
    if (!receiver.intact()) {
      refuse("is damaged: the HDF5 library failed on it; copy or record it again");
    }
    if (kind == Hdf5Record::refused) {
      refuse(value.problem);
    }
    if (kind == Hdf5Record::unclosed) {
      closed_ = false;
      continue;
    }
    (kind == Hdf5Record::attribute ? attributes_ : datasets_)[name] = std::move(value);
  }
}

std::string Hdf5Contents::text(const std::string& name) const {
  const Hdf5Value& value = attribute(name);
  if (value.strings.empty() && value.numbers.empty()) {
    return "";
  }
  const std::vector<std::string> all = texts(name);
  if (all.size() != 1) {
    refuse(fmt::format("attribute '{}' has {} strings; store one", name, all.size()));
  }
  return all.front();
}

std::vector<std::string> Hdf5Contents::texts(const std::string& name) const {
  const Hdf5Value& value = attribute(name);
  if (value.strings.empty()) {
    refuse(fmt::format("attribute '{}' holds no string; store one", name));
  }
  for (const std::string& text : value.strings) {
    if (!is_printable_utf8(text)) {
      refuse(fmt::format("attribute '{}' is not printable UTF-8 text; store it as such", name));
    }
  }
  return value.strings;
}

double Hdf5Contents::number(const std::string& name) const { return numbers(name, 1).front(); }

std::vector<double> Hdf5Contents::numbers(const std::string& name, std::size_t count) const {
  const Hdf5Value& value = attribute(name);
  if (value.numbers.size() != count) {
    refuse(fmt::format("attribute '{}' holds {} numbers; store {}", name, value.numbers.size(),
                       count));
  }
  for (const double number : value.numbers) {
    if (!std::isfinite(number)) {
      refuse(fmt::format("attribute '{}' = {}; store finite numbers", name, number));
    }
  }
  return value.numbers;
}

int Hdf5Contents::integer(const std::string& name, int least) const {
  const double value = number(name);
  if (value != std::floor(value) || value < least || value > std::numeric_limits<int>::max()) {
    refuse(fmt::format("attribute '{}' = {}; store a whole number from {}", name, value, least));
  }
  return static_cast<int>(value);
}

Hdf5Value& Hdf5Contents::dataset(const std::string& name, std::optional<std::size_t> rank) {
  const auto found = datasets_.find(name);
  if (found == datasets_.end()) {
    refuse(fmt::format("dataset '{}' is missing; add it", name));
  }
  Hdf5Value& value = found->second;
  if (!value.problem.empty()) {
    refuse(fmt::format("dataset '{}' {}", name, value.problem));
  }
  if (!value.strings.empty()) {
    refuse(fmt::format("dataset '{}' holds strings; store numbers", name));
  }
  if (rank && value.shape.size() != *rank) {
    refuse(
        fmt::format("dataset '{}' has {} dimensions; give it {}", name, value.shape.size(), *rank));
  }
  return value;
}

void Hdf5Contents::refuse(std::string_view message) const { palpate::refuse(path_, message); }

const Hdf5Value& Hdf5Contents::attribute(const std::string& name) const {
  const auto found = attributes_.find(name);
  if (found == attributes_.end()) {
    refuse(fmt::format("attribute '{}' is missing; add it", name));
  }
  if (!found->second.problem.empty()) {
    refuse(fmt::format("attribute '{}' {}", name, found->second.problem));
  }
  return found->second;
}

}  // namespace palpate
