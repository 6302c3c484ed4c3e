#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "driver/deframer.hpp"
#include "driver/serial_profile.hpp"
#include "sent_frame.hpp"

namespace palpate {

/// Pushes streams through one deframer and compares the decoded frames with the sent frames.
class Receiver {
 public:
  explicit Receiver(const SerialProfile& profile) : deframer_(profile.packet) {}

  void push(std::span<const std::uint8_t> bytes) { deframer_.push(bytes, frames_); }
  void send(const std::vector<SentFrame>& sent) { push(stream_of(sent)); }
  /// Pushes pieces of as many bytes as `size` says, as transfers deliver them.
  template <class Size>
  void push_in_pieces(std::span<const std::uint8_t> bytes, const Size& size) {
    while (!bytes.empty()) {
      const std::size_t piece = std::min<std::size_t>(bytes.size(), size());
      push(bytes.first(piece));
      bytes = bytes.subspan(piece);
    }
  }

  /// Whether the frames [begin, end) came in order, perhaps among other frames.
  bool has(const std::vector<SentFrame>& sent, std::size_t begin, std::size_t end) const {
    auto at = frames_.begin();
    for (std::size_t i = begin; i < end; ++i) {
      at = std::ranges::find(at, frames_.end(), sent[i].values, &Frame::values);
      if (at == frames_.end()) {
        return false;
      }
      ++at;
    }
    return true;
  }

  void expect_exactly(const std::vector<SentFrame>& sent) const {
    ASSERT_EQ(frames_.size(), sent.size());
    EXPECT_TRUE(has(sent, 0, sent.size()));
  }

  /// Number of frames that were not sent.
  auto strangers(const std::vector<SentFrame>& sent) const {
    return std::ranges::count_if(frames_, [&](const Frame& frame) {
      return std::ranges::find(sent, frame.values, &SentFrame::values) == sent.end();
    });
  }

  void clear() { frames_.clear(); }
  const std::vector<Frame>& frames() const { return frames_; }
  std::uint64_t garbage() const { return deframer_.counters().garbage_bytes; }
  std::uint64_t checksum_errors() const { return deframer_.counters().checksum_errors; }

 private:
  PacketDeframer deframer_;
  std::vector<Frame> frames_;
};

}  // namespace palpate
