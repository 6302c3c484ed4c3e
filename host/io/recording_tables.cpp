#include "io/recording_tables.hpp"

#include <cmath>
#include <functional>
#include <iterator>
#include <memory>

#include <fmt/format.h>

#include "io/atomic_file.hpp"
#include "io/input_file.hpp"

namespace palpate {

namespace {

constexpr const char* pressures_name = "pressures.csv";
constexpr const char* array_name = "array.csv";
constexpr const char* poses_name = "poses.csv";

/// A column of a table; a value that is not finite is an empty cell.
struct Column {
  std::string name;
  std::function<double(std::size_t row)> value;
};

/// Writes a CSV file, whose numbers have as many digits as needed; it appears once it is committed.
std::unique_ptr<AtomicFile> table_of(const std::filesystem::path& path,
                                     const std::vector<Column>& columns, std::size_t rows) {
  constexpr std::size_t piece = 1 << 20;
  auto file = std::make_unique<AtomicFile>(path);
  std::string text;
  for (const Column& column : columns) {
    text.append(text.empty() ? "" : ",").append(column.name);
  }
  text += '\n';
  for (std::size_t row = 0; row < rows; ++row) {
    for (const Column& column : columns) {
      if (&column != &columns.front()) {
        text += ',';
      }
      if (const double value = column.value(row); std::isfinite(value)) {
        fmt::format_to(std::back_inserter(text), "{}", value);
      }
    }
    text += '\n';
    if (text.size() >= piece) {
      file->append(text);
      text.clear();
    }
  }
  file->append(text);
  return file;
}

std::vector<Column> pressure_columns(const Recording& r) {
  const std::size_t e = r.elements();
  std::vector<Column> columns;
  if (!r.time_s.empty()) {
    columns.push_back({"time", [&r](std::size_t row) { return r.time_s[row]; }});
  }
  if (!r.device_time_s.empty()) {
    columns.push_back({"device_time", [&r](std::size_t row) { return r.device_time_s[row]; }});
  }
  if (!r.lost_before.empty()) {
    columns.push_back(
        {"lost_before", [&r](std::size_t row) { return static_cast<double>(r.lost_before[row]); }});
  }
  const bool valid_by_row = r.valid.size() > e;
  for (std::size_t i = 0; i < e; ++i) {
    columns.push_back({fmt::format("p{}", i), [=, &r](std::size_t row) {
                         const std::size_t k = row * e + i;
                         return valid_by_row && r.valid[k] == 0 ? std::nan("") : r.pressure[k];
                       }});
  }
  return columns;
}

std::vector<Column> pose_columns(const Recording& r) {
  return {{"x_mm", [&r](std::size_t row) { return r.T_robot_sensor[row].translation_mm.x; }},
          {"y_mm", [&r](std::size_t row) { return r.T_robot_sensor[row].translation_mm.y; }},
          {"theta_rad", [&r](std::size_t row) { return r.T_robot_sensor[row].theta_rad; }}};
}

std::vector<Column> array_columns(const Recording& r) {
  std::vector<Column> columns{{"x_mm", [&r](std::size_t i) { return r.elements_mm[i].x; }},
                              {"y_mm", [&r](std::size_t i) { return r.elements_mm[i].y; }}};
  if (r.valid.size() == r.elements()) {
    columns.push_back({"valid", [&r](std::size_t i) { return r.valid[i] != 0 ? 1.0 : 0.0; }});
  }
  if (!r.baseline.empty()) {
    columns.push_back({"baseline", [&r](std::size_t i) { return r.baseline[i]; }});
  }
  return columns;
}

}  // namespace

void write_tables(const std::filesystem::path& folder, const Recording& recording) {
  if (recording.elements_mm.size() != recording.elements()) {
    refuse(recording.path,
           "dataset 'elements' changes from row to row, which tables cannot hold; read the file "
           "with h5py");
  }
  const std::unique_ptr<AtomicFile> files[] = {
      table_of(folder / pressures_name, pressure_columns(recording), recording.size()),
      table_of(folder / array_name, array_columns(recording), recording.elements()),
      table_of(folder / poses_name, pose_columns(recording), recording.size())};
  for (const auto& file : files) {
    file->commit();
  }
}

std::vector<std::string> table_names() { return {pressures_name, array_name, poses_name}; }

}  // namespace palpate
