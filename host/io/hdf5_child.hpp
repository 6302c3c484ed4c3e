#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// Kinds of records in the stream of send_hdf5_values().
enum class Hdf5Record : char {
  attribute = 'a',
  dataset = 'd',
  refused = 'r',
  unclosed = 'u',
  end = 'e'
};

/// Deflate, the strongest of HDF5's own filters, turns at most 258 bytes into 2 bits.
inline constexpr std::uint64_t largest_compression = 1032;

/// Reads the named attributes and datasets and writes them to the descriptor, one record each: its
/// kind, then name, problem, shape, numbers and strings of Hdf5Value, each with its length as a
/// 64-bit integer before it. A file that cannot be opened is one record `refused` whose problem
/// says why; one that is being written, or whose writer was killed, opens with a record `unclosed`.
/// The record `end`, of a kind alone, is the last of a complete stream.
void send_hdf5_values(int descriptor, const std::filesystem::path& path, std::uint64_t file_bytes,
                      const std::vector<std::string>& attributes,
                      const std::vector<std::string>& datasets);

}  // namespace palpate
