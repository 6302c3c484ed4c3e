#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// Kinds of records in the first answer of serve_hdf5().
enum class Hdf5Record : char { attribute = 'a', dataset = 'd', refused = 'r', end = 'e' };

/// Asks for rows [first, first + count) of a dataset.
struct Hdf5Request {
  std::uint64_t dataset;  ///< its index among the names
  std::uint64_t first;    ///< along the first axis
  std::uint64_t count;
};

/// Opens the file and answers on the socket, in a child of ForkedChild.
///
/// First it sends one record for each named attribute and dataset that exists: its kind, then name,
/// problem, shape, numbers and strings of Hdf5Value, each after its length as a 64-bit integer.
/// Numbers of datasets are left out. A file that cannot be opened gives one record `refused`, whose
/// problem says why. The last record, `end`, has a kind alone.
///
/// Then it answers each Hdf5Request with the rows' numbers in row-major order, in pieces: a 64-bit
/// count from 1 to hdf5_piece and as many doubles. A count of 0 means that the rows cannot be read.
///
/// It opens no other file, whatever links and storage this file names.
void serve_hdf5(int socket, const std::filesystem::path& path, std::uint64_t file_bytes,
                const std::vector<std::string>& attributes,
                const std::vector<std::string>& datasets);

}  // namespace palpate
