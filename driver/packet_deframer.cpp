#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "driver/packet_format.hpp"
#include "driver/serial_profile.hpp"

namespace palpate {

namespace {

/// Decodes packets, one after the other, into frames. A frame may come in several packets: each
/// with one Part of it, or its clock before its values.
class FrameDecoder {
 public:
  using Bytes = PacketLayout::Bytes;

  /// @param layout outlives this object
  explicit FrameDecoder(const PacketLayout& layout) : layout_(layout) {
    for (const PacketFormat::Field& field : layout.fields()) {
      if (const auto* parts = as<PacketFormat::Parts>(field)) {
        know_parts(*parts);
      }
    }
  }

  enum class Meaning : std::uint8_t { values, other, malformed };
  /// Decodes a whole packet, and appends the frames that it completes. A non-finite reading becomes
  /// NaN. A packet that an Only field passes over, or that carries no values, is another one.
  Meaning take(Bytes packet, std::vector<ParsedFrame>& frames) {
    const std::vector<PacketFormat::Field>& fields = layout_.fields();
    for (std::size_t i = 0; i < layout_.middle(); ++i) {
      const auto* only = as<PacketFormat::Only>(fields[i]);
      if (only != nullptr && !begins_like(layout_.place_of(i, packet), only->bytes)) {
        return Meaning::other;
      }
    }
    if (packet.size() < layout_.whole_bytes() ||
        (packet.size() > layout_.whole_bytes() && !layout_.has_parts())) {
      return Meaning::malformed;
    }
    time_s_ =
        layout_.has_parts() ? time_s_ : std::nullopt;  // parts may come behind the clock's packet
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (const auto* only = as<PacketFormat::Only>(fields[i])) {
        if (!begins_like(layout_.place_of(i, packet), only->bytes)) {
          return Meaning::other;
        }
      } else if (const auto* time = as<PacketFormat::Time>(fields[i])) {
        time_s_ = time->type.read(layout_.place_of(i, packet)) * time->tick_s;
      }
    }
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (const auto* values = as<PacketFormat::Values>(fields[i])) {
        read_values(*values, layout_.place_of(i, packet), frames);
      } else if (const auto* parts = as<PacketFormat::Parts>(fields[i])) {
        const Bytes bytes = known_parts(layout_.place_of(i, packet));
        if (bytes.empty()) {
          return Meaning::malformed;
        }
        read_time(bytes);
        read_parts(*parts, bytes, frames);
      }
    }
    return Meaning::values;
  }

  /// Forgets the values of the frame in progress.
  void forget_values() { values_.clear(); }
  /// Forgets the frame in progress, with its time.
  void forget_frame() {
    values_.clear();
    time_s_.reset();
  }
  /// Forgets the clock's last reading, too; its unit stays known.
  void reset() {
    forget_frame();
    last_ticks_.reset();
  }

 private:
  /// The part that begins with a given tag byte.
  struct KnownPart {
    std::size_t bytes = 0;  ///< its size with the tag; 0: no part has this tag
    std::size_t values = 0;
    std::size_t first_element = 0;
    std::optional<PacketFormat::Time> time = {};
  };

  void know_parts(const PacketFormat::Parts& parts) {
    parts_.resize(256);
    // A tag that fits several parts means the first of them.
    for (std::size_t tag = 0; tag < parts_.size(); ++tag) {
      std::size_t element = 0;
      for (const PacketFormat::Part& part : parts.parts) {
        if ((tag & part.mask) == (part.tag & part.mask)) {
          parts_[tag] = {bytes_of(parts, part), part.values, element, part.time};
          break;
        }
        element += part.values;
      }
    }
  }

  void read_values(const PacketFormat::Values& field, Bytes bytes,
                   std::vector<ParsedFrame>& frames) {
    values_.clear();
    for (std::size_t element = 0; element < layout_.format().elements; ++element) {
      const Bytes stride = bytes.subspan(element * field.stride_bytes);
      append_value(field.type.read(stride.subspan(field.at_byte)));
    }
    complete_frame(frames);
  }

  /// The parts in front of the first whose tag is not known; none where a part is cut short.
  Bytes known_parts(Bytes bytes) const {
    std::size_t known = 0;
    while (known < bytes.size() && parts_[bytes[known]].bytes > 0) {
      known += parts_[bytes[known]].bytes;
    }
    return known <= bytes.size() ? bytes.first(known) : Bytes();
  }

  /// Reads the clock that a part may hold; it is that of all parts of its packet.
  void read_time(Bytes bytes) {
    for (; !bytes.empty(); bytes = bytes.subspan(parts_[bytes[0]].bytes)) {
      if (const auto& time = parts_[bytes[0]].time) {
        const double ticks = time->type.read(bytes.subspan(1));
        const double tick_s = time->tick_s > 0.0 ? time->tick_s : tick_of(ticks);
        time_s_ = tick_s > 0.0 ? std::optional(tick_s * ticks) : std::nullopt;
      }
    }
  }

  /// The unit of a clock that does not state it, from its first step; 0 where it is not known yet.
  double tick_of(double ticks) {
    const double step = ticks - last_ticks_.value_or(ticks);
    last_ticks_ = ticks;
    const double period_s = layout_.format().period_s;
    if (tick_s_ == 0.0 && step > 0.0 && period_s > 0.0) {
      const auto misfit = [&](double tick_s) {
        return std::abs(std::log(step * tick_s / period_s));
      };
      tick_s_ = std::ranges::min(std::array{1e-3, 1e-6, 1e-9}, {}, misfit);
    }
    return tick_s_;
  }

  void read_parts(const PacketFormat::Parts& field, Bytes bytes, std::vector<ParsedFrame>& frames) {
    while (!bytes.empty()) {
      const KnownPart& part = parts_[bytes[0]];
      if (part.values > 0) {
        if (part.first_element == 0) {
          values_.clear();
        }
        if (values_.size() != part.first_element) {
          values_.clear();  // the previous part was lost, and the frame with it
        } else {
          for (std::size_t i = 0; i < part.values; ++i) {
            append_value(field.type.read(bytes.subspan(1 + i * field.type.bytes)));
          }
          if (values_.size() == layout_.format().elements) {
            complete_frame(frames);
          }
        }
      }
      bytes = bytes.subspan(part.bytes);
    }
  }

  void append_value(double number) {
    const double value = layout_.format().gain * number + layout_.format().offset;
    values_.push_back(std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN());
  }

  void complete_frame(std::vector<ParsedFrame>& frames) {
    frames.push_back({values_, time_s_});
    forget_frame();
  }

  const PacketLayout& layout_;
  std::vector<KnownPart> parts_;  ///< [tag byte], in formats with Parts
  std::vector<double> values_;    ///< of the frame in progress
  std::optional<double> time_s_;
  std::optional<double> last_ticks_;  ///< of a clock whose unit is not stated
  double tick_s_ = 0.0;               ///< its unit; 0: not known yet
};

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
