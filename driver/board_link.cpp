#include "driver/board_link.hpp"

#include <utility>

#include "palpate/error.hpp"

namespace palpate {

BoardLink::BoardLink(const UsbContext& context, Board& board, UsbDevice device,
                     TransferRing::Counters& counters)
    : context_(context),
      board_(board),
      counters_(counters),
      handle_(std::move(device)),
      source_(board.source(handle_.device())) {
  for (const int interface : source_.interfaces) {
    handle_.claim(interface);
  }
  description_ = board_.configure(handle_);
  description_.serial = handle_.device().serial;
}

void BoardLink::begin() {
  board_.deframer().reset();
  // The ring must be ready before the board sends.
  ring_.emplace(context_, handle_, source_.endpoint, source_.transfer_bytes, counters_);
  try {
    board_.start(handle_);
  } catch (...) {
    ring_.reset();
    throw;
  }
}

std::vector<TransferRing::Completion> BoardLink::end() {
  try {
    board_.stop(handle_);
  } catch (const Error&) {
    // The board may be unplugged; the transfers and interfaces are released either way.
  }
  ring_->drain();
  std::vector<TransferRing::Completion> last = ring_->completed();
  ring_.reset();
  return last;
}

}  // namespace palpate
