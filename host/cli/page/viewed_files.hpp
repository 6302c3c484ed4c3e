#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate::cli {

/// Saved files, for a page to look at: recordings, maps, and what `recognize --json`, `live --json`
/// and `batch` wrote.
class ViewedFiles {
 public:
  /// Reads the files, or of folders what they hold.
  /// @throws Error naming the first that cannot be read or is none of these
  explicit ViewedFiles(std::span<const std::string> paths);

  /// [{name, kind}], kind "recording", "map" or "records", as the event "files".
  std::string list() const;
  /// The JSON behind a path, none where there is nothing:
  /// /file/I: a recording's array and the poses at the ends of its reach, or a map as map_json(),
  /// or of records a row for each: recording, touches, best, probability, truth, error_mm, fit and
  /// act; /file/I/rows/A: at most 64 of a recording's rows from A on: pressure, pose and time;
  /// /file/I/record/K: a record as it was written; of `live`, an unknown's lines as its trace;
  /// /file/I/map/K: the map of that record's pose, where the record names a file that is there.
  std::optional<std::string> get(const std::string& path) const;

 private:
  struct Records {
    std::vector<std::string> text;  ///< JSON of each
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();

    void add(const nlohmann::json& record);
  };
  /// Rows to look at: four digits of a pressure are shown, so float holds it.
  struct Rows {
    Recording recording;  ///< without pressures
    std::size_t elements = 0;
    std::vector<float> pressure;  ///< [n, e]
    double largest = 0.0;         ///< of the pressures but for the last in a thousand; 0: none
  };
  struct File {
    std::filesystem::path path;
    std::variant<Rows, OccupancyGrid, Records> content;
  };

  void add(const std::filesystem::path& path);
  static Rows rows_of(const std::filesystem::path& recording);
  static Records records_of(const std::filesystem::path& results);
  static nlohmann::ordered_json described(const Rows& rows);
  static nlohmann::ordered_json some_of(const Rows& rows, std::size_t first);
  std::optional<nlohmann::ordered_json> answer(const File& file) const;
  std::optional<nlohmann::ordered_json> answer(const File& file, const std::string& what,
                                               std::size_t index) const;

  std::vector<File> files_;
};

}  // namespace palpate::cli
