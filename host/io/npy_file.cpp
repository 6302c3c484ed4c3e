#include "io/npy_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "io/input_file.hpp"
#include "io/stored_bytes.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

static_assert(std::endian::native == std::endian::little, "NPY files are read as they are stored");

constexpr std::string_view magic = "\x93NUMPY";

/// Returns the values of `count` numbers of this type.
template <typename Number>
void widen(const char* bytes, std::size_t count, double* values) {
  for (std::size_t i = 0; i < count; ++i) {
    Number number;
    std::memcpy(&number, bytes + i * sizeof number, sizeof number);
    values[i] = static_cast<double>(number);
  }
}

/// A type of numbers, as numpy's `descr` names it.
struct NumberType {
  std::string_view descr;
  std::size_t width;
  void (*widen)(const char*, std::size_t, double*);
};

constexpr NumberType types[] = {{"<f4", 4, widen<float>},        {"<f8", 8, widen<double>},
                                {"|i1", 1, widen<std::int8_t>},  {"|u1", 1, widen<std::uint8_t>},
                                {"<i2", 2, widen<std::int16_t>}, {"<u2", 2, widen<std::uint16_t>},
                                {"<i4", 4, widen<std::int32_t>}, {"<u4", 4, widen<std::uint32_t>},
                                {"<i8", 8, widen<std::int64_t>}, {"<u8", 8, widen<std::uint64_t>}};

/// What the header says of the numbers.
struct Header {
  std::string descr;
  bool fortran_order = false;
  std::vector<std::size_t> shape;
};

/// The header's dictionary as JSON. It is a literal of Python such as
/// {'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }
nlohmann::json dictionary_of(std::string_view text) {
  std::string json;
  bool quoted = false;
  for (const char c : text) {
    quoted = quoted != (c == '\'');
    if (!quoted && (c == ')' || c == '}')) {
      json.erase(json.find_last_not_of(" \n") + 1);
      if (json.ends_with(',') && !json.ends_with("[,")) {
        json.pop_back();  // Python allows a comma after the last item
      }
    }
    const bool stays = quoted && c != '\'';
    const std::size_t bare = stays ? std::string_view::npos : std::string_view("'()TF").find(c);
    json += bare == std::string_view::npos ? c : "\"[]tf"[bare];
  }
  return nlohmann::json::parse(json, nullptr, false);
}

Header header_of(const std::filesystem::path& path, std::string_view text) {
  const nlohmann::json all = dictionary_of(text);
  const auto item = [&](const char* key) {
    return all.is_object() ? all.value(key, nlohmann::json()) : nlohmann::json();
  };
  const nlohmann::json descr = item("descr");
  const nlohmann::json fortran_order = item("fortran_order");
  const nlohmann::json shape = item("shape");
  if (descr.is_array()) {
    refuse(path, "holds records with named fields; save one array of numbers");
  }
  if (all.size() != 3 || !descr.is_string() || !fortran_order.is_boolean() || !shape.is_array() ||
      !std::ranges::all_of(shape, &nlohmann::json::is_number_unsigned)) {
    refuse(path, "its NPY header is damaged; save the array again with numpy.save");
  }
  return {descr, fortran_order, shape};
}

/// Reads the header's text, up to the numbers.
std::string read_header(std::ifstream& file, const std::filesystem::path& path) {
  char begin[8] = {};
  file.read(begin, sizeof begin);
  const auto version = static_cast<unsigned char>(begin[6]);
  const std::size_t size_bytes = version == 1 ? 2 : 4;
  std::uint32_t size = 0;
  file.read(reinterpret_cast<char*>(&size), static_cast<std::streamsize>(size_bytes));
  if (!file || version < 1 || version > 3 || begin[7] != 0) {
    refuse(path, "is cut off, or of a newer NPY version than 3.0; save the array again");
  }
  constexpr std::uint32_t largest = 1 << 16;
  std::string text(std::min(size, largest), '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file || size > largest) {
    refuse(path, "its NPY header is cut off; save the array again with numpy.save");
  }
  return text;
}

const NumberType& type_of(const std::filesystem::path& path, const std::string& descr) {
  const auto* type = std::ranges::find(types, descr, &NumberType::descr);
  if (type == std::end(types)) {
    refuse(path,
           "holds numbers of type '{}'; save them as float32: numpy.save(file, "
           "array.astype('<f4'))",
           printable(descr));
  }
  return *type;
}

/// Reverses the order of the values: stored with the first index varying fastest.
std::vector<double> from_fortran_order(const std::vector<double>& stored,
                                       const std::vector<std::size_t>& shape) {
  std::vector<double> values(stored.size());
  std::vector<std::size_t> index(shape.size(), 0);
  for (const double value : stored) {
    std::size_t place = 0;
    for (std::size_t axis = 0; axis < shape.size(); ++axis) {
      place = place * shape[axis] + index[axis];
    }
    values[place] = value;
    for (std::size_t axis = 0; axis < shape.size() && ++index[axis] == shape[axis]; ++axis) {
      index[axis] = 0;
    }
  }
  return values;
}

}  // namespace

bool is_npy(const std::filesystem::path& path) {
  require_readable(path);
  std::ifstream file(path, std::ios::binary);
  std::string begin(magic.size(), '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return file && begin == magic;
}

NpyArray read_npy(const std::filesystem::path& path) {
  const std::uintmax_t file_bytes = require_readable(path);
  std::ifstream file(path, std::ios::binary);
  const std::string text = read_header(file, path);
  const Header header = header_of(path, text);
  const NumberType& type = type_of(path, header.descr);
  const std::uint64_t bytes = stored_bytes(header.shape, type.width);
  const auto begin = static_cast<std::uintmax_t>(file.tellg());
  if (bytes != file_bytes - begin) {
    refuse(path, "holds {} bytes of numbers, its shape ({}) makes {}; save the array again",
           file_bytes - begin, fmt::format("{}", fmt::join(header.shape, ", ")), bytes);
  }
  const std::size_t count = bytes / type.width;
  NpyArray array{.shape = header.shape, .values = std::vector<double>(count)};
  constexpr std::size_t piece = 1 << 16;
  std::vector<char> stored(piece * type.width);
  for (std::size_t first = 0; first < count; first += piece) {
    const std::size_t some = std::min(piece, count - first);
    if (!file.read(stored.data(), static_cast<std::streamsize>(some * type.width))) {
      refuse(path, "cannot be read to its end; copy or save it again");
    }
    type.widen(stored.data(), some, array.values.data() + first);
  }
  if (header.fortran_order) {
    array.values = from_fortran_order(array.values, array.shape);
  }
  return array;
}

}  // namespace palpate
