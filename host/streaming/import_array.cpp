#include "streaming/import_steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/input_file.hpp"
#include "model/number_text.hpp"

namespace palpate {

namespace {

/// COLUMNS:ROWS:PITCH or COLUMNSxROWSxPITCH.
struct Grid {
  std::size_t columns = 0;
  std::size_t rows = 0;
  double pitch_mm = 0.0;
};

/// The grid of `array`; none where it names a file, or a program gives the elements.
std::optional<Grid> grid_of(const ImportOptions& options) {
  const std::string& text = options.array;
  std::vector<std::string_view> parts = split_text(text, ':');
  if (parts.size() != 3) {
    parts = split_text(text, 'x');
    if (parts.size() == 3 && !(whole_number_of(parts[1]) && number_of(parts[2]))) {
      return {};  // such as 8x8x3.csv
    }
  }
  const auto columns = parts.size() == 3 ? whole_number_of(parts[0]) : std::nullopt;
  if (!columns || options.elements_mm) {
    return {};
  }
  constexpr std::int64_t limit = 1024;
  const auto rows = whole_number_of(parts[1]);
  const auto pitch_mm = number_of(parts[2]);
  if (*columns < 1 || *columns > limit || !rows || *rows < 1 || *rows > limit || !pitch_mm ||
      *pitch_mm < 1e-3 || *pitch_mm > 1e3) {
    refuse(fmt::format("`array {}`", text),
           "give COLUMNS:ROWS:PITCH, with 1 to {} columns and rows and a pitch of 0.001 to "
           "1000 mm, or a file",
           limit);
  }
  return Grid{static_cast<std::size_t>(*columns), static_cast<std::size_t>(*rows), *pitch_mm};
}

/// The grid's elements in the order in which they are read.
std::vector<glm::dvec2> elements_of(const Grid& grid, const std::string& first,
                                    const std::string& order) {
  const bool top = first == "top-left" || first == "top-right";
  const bool right = first == "bottom-right" || first == "top-right";
  if (!top && !right && first != "bottom-left") {
    refuse(
        fmt::format("`first-element {}`", first),
        "give bottom-left, bottom-right, top-left or top-right: x grows to the right, y upwards");
  }
  if (order != "rows" && order != "columns") {
    refuse(fmt::format("`order {}`", order), "give rows or columns");
  }
  const auto& [columns, rows, pitch_mm] = grid;
  const std::vector<glm::dvec2> by_place =
      grid_array(static_cast<int>(columns), static_cast<int>(rows), pitch_mm);
  std::vector<glm::dvec2> elements_mm;
  for (std::size_t e = 0; e < by_place.size(); ++e) {
    const std::size_t i = order == "rows" ? e % columns : e / rows;
    const std::size_t j = order == "rows" ? e / columns : e % rows;
    const std::size_t column = right ? columns - 1 - i : i;
    const std::size_t row = top ? rows - 1 - j : j;
    elements_mm.push_back(by_place[row * columns + column]);
  }
  return elements_mm;
}

/// Marks the elements of "13,42" as dead.
void mark_dead(const std::string& dead, Recording& array) {
  if (dead.empty()) {
    return;
  }
  const std::size_t elements = array.elements_mm.size();
  array.valid.resize(elements, 1);
  for (const std::string_view text : split_text(dead, ',')) {
    const auto element = whole_number_of(text);
    if (!element || *element < 0 || static_cast<std::size_t>(*element) >= elements) {
      refuse(fmt::format("`dead {}`", dead),
             "'{}' is no element; count them from 0 to {} in the order of their readings", text,
             elements - 1);
    }
    array.valid[static_cast<std::size_t>(*element)] = 0;
  }
}

}  // namespace

std::optional<std::array<std::size_t, 2>> grid_size(const ImportOptions& options) {
  const std::optional<Grid> grid = grid_of(options);
  return grid && grid->rows > 1 ? std::optional(std::array{grid->columns, grid->rows})
                                : std::nullopt;
}

Recording import_array(const ImportOptions& options) {
  if (options.pressure_unit != "kPa" && options.pressure_unit != "raw") {
    refuse(fmt::format("`pressure-unit {}`", options.pressure_unit), "give kPa or raw");
  }
  Recording array;
  if (const std::optional<Grid> grid = grid_of(options)) {
    array.elements_mm = elements_of(*grid, options.first_element, options.order);
  } else {
    const bool has_first = options.first_element != ImportOptions{}.first_element;
    if (has_first || options.order != ImportOptions{}.order) {
      refuse(has_first ? "`first-element`" : "`order`",
             "is for a grid, COLUMNS:ROWS:PITCH; the elements of a file or of a program have "
             "their places");
    }
    array = options.elements_mm ? Recording{.elements_mm = *options.elements_mm}
                                : read_array(options.array);
  }
  if (array.elements_mm.empty()) {
    refuse("array", "has no element; give centres [e, 2] in mm, e at least 1");
  }
  mark_dead(options.dead, array);
  return array;
}

void mark_unknown(const std::string& path, const ImportSurvey& survey, Recording& recording) {
  std::vector<std::uint8_t> read = survey.read;
  const std::size_t e = read.size();
  for (std::size_t i = 0; i < recording.valid.size(); ++i) {
    read[i] &= recording.valid[i];
  }
  if (std::ranges::count(read, 0) == static_cast<std::ptrdiff_t>(e)) {
    refuse(path, "holds no reading of a living element; write the pressures");
  }
  if (!recording.valid.empty() || std::ranges::count(read, 0) > 0) {
    recording.valid = read;
  }
  if (recording.rows != "touches") {
    return;
  }
  bool some_unknown = false;
  std::vector<std::uint8_t> valid(recording.pressure.size());
  for (std::size_t k = 0; k < valid.size(); ++k) {
    valid[k] = std::isnan(recording.pressure[k]) ? 0 : read[k % e];
    some_unknown = some_unknown || valid[k] != read[k % e];
  }
  if (some_unknown) {
    recording.valid = std::move(valid);
  }
}

ImportSurvey survey_of(const Recording& recording) {
  const std::size_t e = recording.elements_mm.size();
  ImportSurvey survey{.load = {}, .read = std::vector<std::uint8_t>(e, 0), .whole_up_to = {}};
  std::vector<double> least(e, std::numeric_limits<double>::infinity());
  bool whole = true;
  double largest = 0.0;
  for (std::size_t k = 0; k < recording.pressure.size(); ++k) {
    const double p = recording.pressure[k];
    const std::size_t i = k % e;
    if (i == 0) {
      survey.load.push_back(0.0F);
    }
    if (!std::isfinite(p)) {
      continue;
    }
    survey.read[i] = 1;
    whole = whole && p == std::floor(p);
    largest = std::max(largest, p);
    if (recording.valid.empty() || recording.valid[i] != 0) {
      least[i] = std::min(least[i], p);
      survey.load.back() = std::max(survey.load.back(), static_cast<float>(p - least[i]));
    }
  }
  constexpr double least_raw = 100.0;  // thresholded pressures may be small whole numbers
  survey.whole_up_to = whole && largest >= least_raw ? std::optional(largest) : std::nullopt;
  return survey;
}

std::vector<bool> ImportSurvey::pressed() const {
  const float peak = load.empty() ? 0.0F : *std::ranges::max_element(load);
  std::vector<bool> pressed;
  for (const float l : load) {
    pressed.push_back(l > 0.0F && l >= 0.5F * peak);
  }
  return pressed;
}

}  // namespace palpate
