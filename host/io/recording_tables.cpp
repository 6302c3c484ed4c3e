#include "io/recording_tables.hpp"

#include <cmath>
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

/// A CSV file that grows row by row.
class Table {
 public:
  Table(const std::filesystem::path& path, const std::vector<std::string>& names) : file_(path) {
    for (const std::string& name : names) {
      begin_cell();
      text_ += name;
    }
    end_row();
  }

  /// A number with as many digits as needed; an empty cell where it is not finite.
  void add(double value) {
    begin_cell();
    if (std::isfinite(value)) {
      fmt::format_to(std::back_inserter(text_), "{}", value);
    }
  }
  void add_empty() { begin_cell(); }
  void end_row() {
    constexpr std::size_t piece = 1 << 20;
    text_ += '\n';
    row_is_new_ = true;
    if (text_.size() >= piece) {
      flush();
    }
  }
  void flush() {
    file_.append(text_);
    text_.clear();
  }
  void commit() { file_.commit(); }

 private:
  void begin_cell() {
    if (!row_is_new_) {
      text_ += ',';
    }
    row_is_new_ = false;
  }

  AtomicFile file_;
  std::string text_;  ///< not yet in the file
  bool row_is_new_ = true;
};

std::unique_ptr<Table> pressures_of(const Recording& r, const std::filesystem::path& path) {
  const std::size_t e = r.elements();
  std::vector<std::string> names;
  for (const auto& [name, there] : {std::pair{"time", !r.time_s.empty()},
                                    {"device_time", !r.device_time_s.empty()},
                                    {"lost_before", !r.lost_before.empty()}}) {
    if (there) {
      names.emplace_back(name);
    }
  }
  for (std::size_t i = 0; i < e; ++i) {
    names.push_back(fmt::format("p{}", i));
  }
  auto table = std::make_unique<Table>(path, names);
  const bool valid_by_row = r.valid.size() > e;
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (!r.time_s.empty()) {
      table->add(r.time_s[i]);
    }
    if (!r.device_time_s.empty()) {
      table->add(r.device_time_s[i]);
    }
    if (!r.lost_before.empty()) {
      table->add(static_cast<double>(r.lost_before[i]));
    }
    for (std::size_t k = i * e; k < (i + 1) * e; ++k) {
      if (valid_by_row && r.valid[k] == 0) {
        table->add_empty();
      } else {
        table->add(r.pressure[k]);
      }
    }
    table->end_row();
  }
  return table;
}

std::unique_ptr<Table> poses_of(const Recording& r, const std::filesystem::path& path) {
  auto table = std::make_unique<Table>(path, std::vector<std::string>{"x_mm", "y_mm", "theta_rad"});
  for (const Pose& pose : r.T_robot_sensor) {
    table->add(pose.translation_mm.x);
    table->add(pose.translation_mm.y);
    table->add(pose.theta_rad);
    table->end_row();
  }
  return table;
}

std::unique_ptr<Table> array_of(const Recording& r, const std::filesystem::path& path) {
  const bool has_valid = r.valid.size() == r.elements();
  std::vector<std::string> names{"x_mm", "y_mm"};
  if (has_valid) {
    names.emplace_back("valid");
  }
  if (!r.baseline.empty()) {
    names.emplace_back("baseline");
  }
  auto table = std::make_unique<Table>(path, names);
  for (std::size_t i = 0; i < r.elements(); ++i) {
    table->add(r.elements_mm[i].x);
    table->add(r.elements_mm[i].y);
    if (has_valid) {
      table->add(r.valid[i] != 0 ? 1.0 : 0.0);
    }
    if (!r.baseline.empty()) {
      table->add(r.baseline[i]);
    }
    table->end_row();
  }
  return table;
}

}  // namespace

void write_tables(const std::filesystem::path& folder, const Recording& recording) {
  if (recording.elements_mm.size() != recording.elements()) {
    refuse(recording.path,
           "dataset 'elements' changes from row to row, which tables cannot hold; read the file "
           "with h5py");
  }
  std::vector<std::unique_ptr<Table>> tables;
  tables.push_back(pressures_of(recording, folder / pressures_name));
  tables.push_back(array_of(recording, folder / array_name));
  tables.push_back(poses_of(recording, folder / poses_name));
  for (const auto& table : tables) {
    table->flush();
  }
  for (const auto& table : tables) {
    table->commit();
  }
}

std::vector<std::string> table_names() { return {pressures_name, array_name, poses_name}; }

}  // namespace palpate
