#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "driver/frame_decoder.hpp"
#include "driver/packet_layout.hpp"
#include "driver/serial_profile.hpp"

namespace palpate {

namespace {

/// Finds packets of a declared format in a byte stream, which may begin anywhere, lose bytes and
/// hold other packets, and has them decoded into frames.
///
/// For example, two elements and their sum behind a preamble:
///
///     packet: [{bytes: aa 55}, {values: u8}, {checksum: sum8, from: 2}]
///
///     31              garbage: no packet begins so, and the next byte is tried
///     aa 55 07 09 10  a packet, as 07 + 09 = 10: the frame 7, 9
///     aa 55           its rest was lost: aa 55 aa 55 03 has a wrong sum, and aa and 55 are garbage
///     aa 55 03 04 07  a packet: the frame 3, 4
///     aa 55 05 06 ff  a wrong sum, and five bytes of garbage
///
/// - In step, a packet is taken when its last byte arrives.
/// - Out of step, every byte is tried as the start of a packet. A packet counts if its checksum is
///   right; in a format without checksum, if another preamble follows or a terminator precedes it.
///   Such a format has two limits: a payload that holds the preamble's bytes at one place in every
///   frame may be taken for the preamble until it changes, and a lost byte spoils its frame.
///
/// The work per byte is bounded for any input: checksums are computed from running values, and at
/// most 4096 bytes of parts are read in vain, in formats without checksum only. Memory: two packets
/// of the largest size and the bytes of two pushes.
class PacketDeframer final : public Deframer {
 public:
  using Bytes = std::span<const std::uint8_t>;

  explicit PacketDeframer(const PacketFormat& format) : layout_(format), decoder_(layout_) {}
  PacketDeframer(const PacketDeframer&) = delete;
  PacketDeframer& operator=(const PacketDeframer&) = delete;

  void push(Bytes bytes, std::vector<ParsedFrame>& frames) override {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    if (has_check()) {
      for (const std::uint8_t byte : bytes) {
        running_.push_back(layout_.check()->checksum.run_on(running_.back(), byte));
      }
    }
    while (at_ < buffer_.size() && take_step(frames)) {
    }
    forget_consumed();
  }

  void reset() override {
    buffer_.clear();
    running_.assign(1, 0);
    at_ = 0;
    in_step_ = true;
    decoder_.reset();
  }

  const DeframerCounters& counters() const override { return counters_; }

 private:
  bool has_check() const { return layout_.check() != nullptr; }

  void forget_consumed() {
    // The last terminator stays: it tells where the next packet begins.
    const auto consumed =
        static_cast<std::ptrdiff_t>(at_ - std::min(at_, layout_.terminator().size()));
    // Erase once half of the buffer is consumed: erasing at each push would move the rest each
    // time.
    if (2 * consumed >= static_cast<std::ptrdiff_t>(buffer_.size())) {
      buffer_.erase(buffer_.begin(), buffer_.begin() + consumed);
      if (has_check()) {
        running_.erase(running_.begin(), running_.begin() + consumed);
      }
      at_ -= static_cast<std::size_t>(consumed);
    }
  }

  /// Takes a packet or drops a byte; false where more bytes have to come first.
  bool take_step(std::vector<ParsedFrame>& frames) {
    if (!in_step_ && !follows_terminator()) {
      return drop_byte();
    }
    const Bytes stream = Bytes(buffer_).subspan(at_);
    const PacketLayout::Packet packet = layout_.packet_at_front(stream);
    if (packet.fit == PacketLayout::Packet::Fit::incomplete) {
      return false;
    }
    if (packet.fit == PacketLayout::Packet::Fit::none) {
      return drop_byte();
    }
    if (!checksum_is_right(stream.first(packet.bytes))) {
      counters_.checksum_errors += in_step_ ? 1 : 0;
      return drop_byte();
    }
    if (!in_step_ && !has_check()) {
      const Bytes next = stream.subspan(packet.bytes);
      if (!begins_like(next, layout_.preamble())) {
        return drop_byte();
      }
      if (next.size() < layout_.preamble().size()) {
        return false;
      }
    }
    if (decoder_.take(stream.first(packet.bytes), frames) == FrameDecoder::Meaning::malformed) {
      decoder_.forget_values();
      if (!has_check()) {
        return drop_byte();
      }
      counters_.garbage_bytes += packet.bytes;
    }
    at_ += packet.bytes;
    in_step_ = true;
    return true;
  }

  /// Returns true: a step is taken.
  bool drop_byte() {
    if (in_step_) {
      decoder_.forget_frame();
    }
    in_step_ = false;
    ++at_;
    ++counters_.garbage_bytes;
    return true;
  }

  bool follows_terminator() const {
    const std::size_t bytes = layout_.terminator().size();
    return at_ >= bytes &&
           begins_like(Bytes(buffer_).subspan(at_ - bytes, bytes), layout_.terminator());
  }

  bool checksum_is_right(Bytes packet) const {
    if (!has_check()) {
      return true;
    }
    const Checksum& checksum = layout_.check()->checksum;
    const PacketLayout::CheckPlace place = layout_.check_place(packet.size());
    const NumberType type{NumberType::Kind::unsigned_integer,
                          static_cast<std::uint8_t>(checksum.bytes()), layout_.check()->big_endian};
    return type.read(packet.subspan(place.offset)) ==
           checksum.of_stretch(running_[at_ + place.begin], running_[at_ + place.end],
                               place.end - place.begin);
  }

  PacketLayout layout_;
  FrameDecoder decoder_;
  std::vector<std::uint8_t> buffer_;          // recent bytes of the stream
  std::vector<std::uint32_t> running_ = {0};  // running checksum before each and after the last
  std::size_t at_ = 0;                        // index of the first byte not yet consumed
  bool in_step_ = true;
  DeframerCounters counters_;
};

}  // namespace

std::unique_ptr<Deframer> make_deframer(const SerialProfile& profile) {
  return std::make_unique<PacketDeframer>(profile.packet);
}

}  // namespace palpate
