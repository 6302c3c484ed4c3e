#include <cmath>
#include <limits>

#include "io/hdf5_contents.hpp"
#include "model/printable.hpp"

namespace palpate {

std::string Hdf5Contents::text(const std::string& name) const {
  const Attribute& value = find(attributes_, "attribute", name);
  if (value.texts.empty() && value.numbers.empty()) {
    return "";
  }
  const std::vector<std::string> all = texts(name);
  if (all.size() != 1) {
    refuse("attribute '{}' has {} strings; store one", name, all.size());
  }
  return all.front();
}

std::vector<std::string> Hdf5Contents::texts(const std::string& name) const {
  const Attribute& value = find(attributes_, "attribute", name);
  if (value.texts.empty()) {
    refuse("attribute '{}' holds no string; store one", name);
  }
  for (const std::string& text : value.texts) {
    if (!is_printable(text)) {
      refuse("attribute '{}' is not printable UTF-8 text; store it as such", name);
    }
  }
  return value.texts;
}

double Hdf5Contents::number(const std::string& name) const { return numbers(name, 1).front(); }

std::vector<double> Hdf5Contents::numbers(const std::string& name, std::size_t count) const {
  const Attribute& value = find(attributes_, "attribute", name);
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

}  // namespace palpate
