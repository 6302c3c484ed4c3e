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

#include "driver/serial_profile.hpp"

namespace palpate {

namespace {

using Bytes = std::span<const std::uint8_t>;

/// Whether `bytes` begins with `pattern`, or `pattern` with `bytes`.
bool begins_like(Bytes bytes, const std::vector<std::uint8_t>& pattern) {
  const std::size_t known = std::min(bytes.size(), pattern.size());
  return std::equal(pattern.begin(), pattern.begin() + static_cast<std::ptrdiff_t>(known),
                    bytes.begin());
}

template <class Field>
const Field* as(const PacketFormat::Field& field) {
  return std::get_if<Field>(&field);
}

/// Finds packets of a declared format in a byte stream and decodes them into frames. The stream may
/// begin anywhere, lose bytes and hold other packets.
///
/// In step, the deframer takes a packet when its last byte arrives. Out of step, it tries every
/// byte as the start of a packet, and accepts a packet with the right checksum; in a format without
/// checksum, a packet that another preamble follows or a terminator precedes. Such a format has two
/// limits: a payload that holds the preamble's bytes at one place in every frame may be taken for
/// the preamble until it changes, and a lost byte spoils its frame.
///
/// The work per byte is bounded for any input: checksums are computed from running values, and at
/// most 4096 bytes of parts are read in vain, in formats without checksum only. Memory: two packets
/// of the largest size and the bytes of two pushes. A non-finite reading becomes NaN.
class PacketDeframer final : public Deframer {
 public:
  explicit PacketDeframer(const PacketFormat& format)
      : format_(format),
        shape_(shape_of(format_)),
        fields_(format_.fields),
        shifted_from_(fields_.size() - shape_.tail_fields) {
    if (const auto* first = as<PacketFormat::Fixed>(fields_.front())) {
      preamble_ = first->bytes;
    } else if (const auto* last = as<PacketFormat::Fixed>(fields_.back())) {
      terminator_ = last->bytes;
    }
    for (const PacketFormat::Field& field : fields_) {
      offsets_.push_back(whole_bytes_);
      whole_bytes_ += bytes_of(field, format_.elements, shape_.counted);
      if (const auto* check = as<PacketFormat::Check>(field)) {
        check_ = check;
        check_field_ = offsets_.size() - 1;
      } else if (const auto* parts = as<PacketFormat::Parts>(field)) {
        know_parts(*parts);
        shifted_from_ = std::min(shifted_from_, offsets_.size());
      }
    }
    reset();
  }
  PacketDeframer(const PacketDeframer&) = delete;
  PacketDeframer& operator=(const PacketDeframer&) = delete;

  void push(Bytes bytes, std::vector<ParsedFrame>& frames) override {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    if (check_ != nullptr) {
      for (const std::uint8_t byte : bytes) {
        running_.push_back(check_->checksum.run_on(running_.back(), byte));
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
    values_.clear();
    time_s_.reset();
    last_ticks_.reset();  // the unit stays known
  }

  const DeframerCounters& counters() const override { return counters_; }

 private:
  enum class Verdict { none, incomplete, wrong_checksum, whole };
  struct Candidate {
    Verdict verdict = Verdict::none;
    std::size_t bytes = 0;  // size of the packet
  };
  enum class Meaning { values, other, malformed };
  /// The part that begins with a given tag byte.
  struct KnownPart {
    std::size_t bytes = 0;  // its size with the tag; 0: no part has this tag
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

  void forget_consumed() {
    // The last terminator stays: it tells where the next packet begins.
    const auto consumed = static_cast<std::ptrdiff_t>(at_ - std::min(at_, terminator_.size()));
    // Erase once half of the buffer is consumed: erasing at each push would move the rest each
    // time.
    if (2 * consumed >= static_cast<std::ptrdiff_t>(buffer_.size())) {
      buffer_.erase(buffer_.begin(), buffer_.begin() + consumed);
      if (check_ != nullptr) {
        running_.erase(running_.begin(), running_.begin() + consumed);
      }
      at_ -= static_cast<std::size_t>(consumed);
    }
  }

  bool take_step(std::vector<ParsedFrame>& frames) {
    if (!in_step_ && !follows_terminator()) {
      return drop_byte();
    }
    const Bytes stream = Bytes(buffer_).subspan(at_);
    const Candidate candidate = inspect(stream);
    switch (candidate.verdict) {
      case Verdict::incomplete:
        return false;
      case Verdict::wrong_checksum:
        counters_.checksum_errors += in_step_ ? 1 : 0;
        [[fallthrough]];
      case Verdict::none:
        return drop_byte();
      case Verdict::whole:
        break;
    }
    if (!in_step_ && check_ == nullptr) {
      const Bytes next = stream.subspan(candidate.bytes);
      if (!begins_like(next, preamble_)) {
        return drop_byte();
      }
      if (next.size() < preamble_.size()) {
        return false;
      }
    }
    if (interpret(stream.first(candidate.bytes), frames) == Meaning::malformed) {
      values_.clear();
      if (check_ == nullptr) {
        return drop_byte();
      }
      counters_.garbage_bytes += candidate.bytes;
    }
    at_ += candidate.bytes;
    in_step_ = true;
    return true;
  }

  /// Returns true: a step is taken.
  bool drop_byte() {
    if (in_step_) {
      values_.clear();
      time_s_.reset();
    }
    in_step_ = false;
    ++at_;
    ++counters_.garbage_bytes;
    return true;
  }

  bool follows_terminator() const {
    return at_ >= terminator_.size() &&
           std::equal(terminator_.begin(), terminator_.end(),
                      buffer_.begin() + static_cast<std::ptrdiff_t>(at_ - terminator_.size()));
  }

  /// Where a field begins in a packet of this size.
  std::size_t begin_of(std::size_t field, std::size_t packet_bytes) const {
    return offsets_[field] + (field < shifted_from_ ? 0 : packet_bytes - whole_bytes_);
  }

  /// A field of a packet with values.
  Bytes place_of(std::size_t field, Bytes packet) const {
    std::size_t bytes = bytes_of(fields_[field], format_.elements, shape_.counted);
    if (shape_.counted && as<PacketFormat::Parts>(fields_[field]) != nullptr) {
      bytes = packet.size() - whole_bytes_;
    }
    return packet.subspan(begin_of(field, packet.size()), bytes);
  }

  Candidate inspect(Bytes stream) const {
    std::size_t total = whole_bytes_;
    // Behind a Length, only packets with values have a field at its offset. The tail follows below.
    const std::size_t known = shape_.counted ? shape_.head_fields : fields_.size();
    for (std::size_t i = 0; i < known && offsets_[i] <= stream.size(); ++i) {
      const Bytes rest = stream.subspan(offsets_[i]);
      if (const auto* fixed = as<PacketFormat::Fixed>(fields_[i])) {
        if (!begins_like(rest, fixed->bytes)) {
          return {Verdict::none};
        }
      } else if (const auto* length = as<PacketFormat::Length>(fields_[i])) {
        if (rest.size() < length->type.bytes) {
          return {Verdict::incomplete};
        }
        const double count = length->type.read(rest) - static_cast<double>(length->extra);
        if (count < 0 || count > static_cast<double>(length->most)) {
          return {Verdict::none};
        }
        total += static_cast<std::size_t>(count) - shape_.middle_bytes;
      }
    }
    if (stream.size() < total) {
      return {Verdict::incomplete};
    }
    const Bytes packet = stream.first(total);
    for (std::size_t i = fields_.size() - shape_.tail_fields; i < fields_.size(); ++i) {
      const auto* fixed = as<PacketFormat::Fixed>(fields_[i]);
      if (fixed != nullptr && !begins_like(packet.subspan(begin_of(i, total)), fixed->bytes)) {
        return {Verdict::none};
      }
    }
    return {checksum_is_right(packet) ? Verdict::whole : Verdict::wrong_checksum, total};
  }

  bool checksum_is_right(Bytes packet) const {
    if (check_ == nullptr) {
      return true;
    }
    const std::size_t offset = begin_of(check_field_, packet.size());
    const std::size_t bytes = check_->checksum.bytes();
    const NumberType type{NumberType::Kind::unsigned_integer, static_cast<std::uint8_t>(bytes),
                          check_->big_endian};
    const std::size_t begin = check_->after ? offset + bytes : check_->from_byte;
    const std::size_t end = check_->after ? packet.size() : offset;
    return type.read(packet.subspan(offset)) ==
           check_->checksum.of_stretch(running_[at_ + begin], running_[at_ + end], end - begin);
  }

  Meaning interpret(Bytes packet, std::vector<ParsedFrame>& frames) {
    for (std::size_t i = 0; i < shape_.head_fields; ++i) {
      const auto* only = as<PacketFormat::Only>(fields_[i]);
      if (only != nullptr && !begins_like(packet.subspan(offsets_[i]), only->bytes)) {
        return Meaning::other;
      }
    }
    if (packet.size() < whole_bytes_ || (packet.size() > whole_bytes_ && !shape_.parts)) {
      return Meaning::malformed;
    }
    time_s_ = shape_.parts ? time_s_ : std::nullopt;  // parts may come behind the clock's packet
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (const auto* only = as<PacketFormat::Only>(fields_[i])) {
        if (!begins_like(place_of(i, packet), only->bytes)) {
          return Meaning::other;
        }
      } else if (const auto* time = as<PacketFormat::Time>(fields_[i])) {
        time_s_ = time->type.read(place_of(i, packet)) * time->tick_s;
      }
    }
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (const auto* values = as<PacketFormat::Values>(fields_[i])) {
        read_values(*values, place_of(i, packet), frames);
      } else if (const auto* parts = as<PacketFormat::Parts>(fields_[i])) {
        const Bytes bytes = known_parts(place_of(i, packet));
        if (bytes.empty()) {
          return Meaning::malformed;
        }
        read_time(bytes);
        read_parts(*parts, bytes, frames);
      }
    }
    return Meaning::values;
  }

  void read_values(const PacketFormat::Values& field, Bytes bytes,
                   std::vector<ParsedFrame>& frames) {
    values_.clear();
    for (std::size_t element = 0; element < format_.elements; ++element) {
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
    if (tick_s_ == 0.0 && step > 0.0 && format_.period_s > 0.0) {
      const auto misfit = [&](double tick_s) {
        return std::abs(std::log(step * tick_s / format_.period_s));
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
          if (values_.size() == format_.elements) {
            complete_frame(frames);
          }
        }
      }
      bytes = bytes.subspan(part.bytes);
    }
  }

  void append_value(double number) {
    const double value = format_.gain * number + format_.offset;
    values_.push_back(std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN());
  }

  void complete_frame(std::vector<ParsedFrame>& frames) {
    frames.push_back({values_, time_s_});
    values_.clear();
    time_s_.reset();
  }

  PacketFormat format_;
  PacketShape shape_;
  const std::vector<PacketFormat::Field>& fields_;  // the format's
  // The layout of a packet with values, without counted Parts:
  std::vector<std::size_t> offsets_;  // [field]
  std::size_t whole_bytes_ = 0;
  std::size_t shifted_from_;  // the first field that keeps its distance from the packet's end
  std::vector<std::uint8_t> preamble_;          // empty: a terminator marks the packets
  std::vector<std::uint8_t> terminator_;        // empty if there is a preamble
  const PacketFormat::Check* check_ = nullptr;  // the format's, if it has one
  std::size_t check_field_ = 0;                 // its index
  std::vector<KnownPart> parts_;                // [tag byte], in formats with Parts

  std::vector<std::uint8_t> buffer_;    // recent bytes of the stream
  std::vector<std::uint32_t> running_;  // running checksum before each of them and after the last
  std::size_t at_ = 0;                  // index of the first byte not yet consumed
  bool in_step_ = true;

  std::vector<double> values_;  // of the frame in progress
  std::optional<double> time_s_;
  std::optional<double> last_ticks_;  // of a clock whose unit is not stated
  double tick_s_ = 0.0;               // its unit; 0: not known yet
  DeframerCounters counters_;
};

}  // namespace

std::unique_ptr<Deframer> make_deframer(const SerialProfile& profile) {
  return std::make_unique<PacketDeframer>(profile.packet);
}

}  // namespace palpate
