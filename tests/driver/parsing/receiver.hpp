#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "driver/serial_profile.hpp"
#include "sent_frame.hpp"

namespace palpate {

/// Pushes streams through one deframer and compares the decoded frames with the sent frames.
class Receiver {
 public:
  explicit Receiver(const SerialProfile& profile) : deframer_(make_deframer(profile)) {}

  void push(const Bytes& bytes) { deframer_->push(bytes, frames_); }
  void send(const std::vector<SentFrame>& sent) { push(stream_of(sent)); }

  /// Whether the frames [begin, end) came in order, perhaps among other frames.
  bool has(const std::vector<SentFrame>& sent, std::size_t begin, std::size_t end) const {
    auto at = frames_.begin();
    for (std::size_t i = begin; i < end; ++i) {
      at = std::find_if(at, frames_.end(),
                        [&](const ParsedFrame& frame) { return frame.values == sent[i].values; });
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

  std::size_t strangers(const std::vector<SentFrame>& sent) const {
    return static_cast<std::size_t>(
        std::count_if(frames_.begin(), frames_.end(), [&](const ParsedFrame& frame) {
          return std::none_of(sent.begin(), sent.end(),
                              [&](const SentFrame& s) { return s.values == frame.values; });
        }));
  }

  void clear() { frames_.clear(); }
  void reset() { deframer_->reset(); }
  const std::vector<ParsedFrame>& frames() const { return frames_; }
  std::uint64_t garbage() const { return deframer_->counters().garbage_bytes; }
  std::uint64_t checksum_errors() const { return deframer_->counters().checksum_errors; }

 private:
  std::unique_ptr<Deframer> deframer_;
  std::vector<ParsedFrame> frames_;
};

}  // namespace palpate
