#include "driver/board.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "driver/serial_board.hpp"
#include "driver/takktile_board.hpp"
#include "palpate/error.hpp"

namespace palpate {

std::uint64_t Board::parse(const TransferRing::Completion& completion,
                           std::vector<ParsedFrame>& frames) {
  const std::uint64_t before = deframer().counters().checksum_errors;
  deframer().push(completion.bytes, frames);
  return deframer().counters().checksum_errors - before;
}

std::unique_ptr<Board> make_board(const std::string& name) {
  if (name == TakktileBoard::kind) {
    return std::make_unique<TakktileBoard>();
  }
  std::vector<std::string> known = shipped_profiles();
  if (!is_profile_path(name) && std::ranges::find(known, name) == known.end()) {
    known.insert(known.begin(), TakktileBoard::kind);
    throw Error(Fault::input,
                fmt::format("sensor '{}': no such board; give one of {}, or the path of a profile "
                            "that ends in .yaml",
                            name, fmt::join(known, ", ")));
  }
  return std::make_unique<SerialBoard>(name, read_serial_profile(name));
}

std::vector<std::unique_ptr<Board>> known_boards() {
  std::vector<std::unique_ptr<Board>> boards;
  boards.push_back(std::make_unique<TakktileBoard>());
  for (const std::string& name : shipped_profiles()) {
    boards.push_back(make_board(name));
  }
  return boards;
}

}  // namespace palpate
