#include "driver/packet_deframer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

}  // namespace

PacketDeframer::PacketDeframer(PacketFormat format)
    : format_(std::move(format)), shape_(shape_of(format_)) {
  if (const auto* first = as<PacketFormat::Fixed>(format_.fields.front())) {
    preamble_ = first->bytes;
  } else if (const auto* last = as<PacketFormat::Fixed>(format_.fields.back())) {
    terminator_ = last->bytes;
  }
  for (const PacketFormat::Field& field : format_.fields) {
    if (const auto* check = as<PacketFormat::Check>(field)) {
      checksum_ = &check->checksum;
    } else if (const auto* parts = as<PacketFormat::Parts>(field)) {
      parts_.resize(256);
      // A tag that fits several parts means the first of them.
      for (std::size_t tag = 0; tag < parts_.size(); ++tag) {
        std::size_t element = 0;
        for (const PacketFormat::Part& part : parts->parts) {
          if ((tag & part.mask) == (part.tag & part.mask)) {
            parts_[tag] = {bytes_of(*parts, part), part.values, element};
            break;
          }
          element += part.values;
        }
      }
    }
  }
  reset();
}

void PacketDeframer::reset() {
  buffer_.clear();
  running_.assign(1, 0);
  at_ = 0;
  in_step_ = true;
  values_.clear();
}

void PacketDeframer::push(Bytes bytes, std::vector<ParsedFrame>& frames) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  if (checksum_ != nullptr) {
    for (const std::uint8_t byte : bytes) {
      running_.push_back(checksum_->run_on(running_.back(), byte));
    }
  }
  while (at_ < buffer_.size() && take_step(frames)) {
  }
  forget_consumed();
}

void PacketDeframer::forget_consumed() {
  // The last terminator stays: it tells where the next packet begins.
  const auto consumed = static_cast<std::ptrdiff_t>(at_ - std::min(at_, terminator_.size()));
  // Erase once half of the buffer is consumed: erasing at each push would move the rest each time.
  if (2 * consumed >= static_cast<std::ptrdiff_t>(buffer_.size())) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + consumed);
    if (checksum_ != nullptr) {
      running_.erase(running_.begin(), running_.begin() + consumed);
    }
    at_ -= static_cast<std::size_t>(consumed);
  }
}

bool PacketDeframer::take_step(std::vector<ParsedFrame>& frames) {
  if (!in_step_ && !follows_terminator()) {
    drop_byte();
    return true;
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
      drop_byte();
      return true;
    case Verdict::whole:
      break;
  }
  if (!in_step_ && checksum_ == nullptr) {
    const Bytes next = stream.subspan(candidate.bytes);
    if (!begins_like(next, preamble_)) {
      drop_byte();
      return true;
    }
    if (next.size() < preamble_.size()) {
      return false;
    }
  }
  if (interpret(stream.first(candidate.bytes), frames) == Meaning::malformed) {
    values_.clear();
    if (checksum_ == nullptr) {
      drop_byte();
      return true;
    }
    counters_.garbage_bytes += candidate.bytes;
  }
  at_ += candidate.bytes;
  in_step_ = true;
  return true;
}

void PacketDeframer::drop_byte() {
  if (in_step_) {
    values_.clear();
  }
  in_step_ = false;
  ++at_;
  ++counters_.garbage_bytes;
}

bool PacketDeframer::follows_terminator() const {
  return at_ >= terminator_.size() &&
         std::equal(terminator_.begin(), terminator_.end(),
                    buffer_.begin() + static_cast<std::ptrdiff_t>(at_ - terminator_.size()));
}

PacketDeframer::Candidate PacketDeframer::inspect(Bytes stream) const {
  std::size_t middle_bytes = shape_.middle_bytes;
  std::size_t offset = 0;
  for (const PacketFormat::Field& field : format_.fields) {
    if (const auto* fixed = as<PacketFormat::Fixed>(field)) {
      if (!begins_like(stream.subspan(offset), fixed->bytes)) {
        return {Verdict::none};
      }
    } else if (const auto* length = as<PacketFormat::Length>(field)) {
      if (stream.size() - offset < length->type.bytes) {
        return {Verdict::incomplete};
      }
      const double count =
          length->type.read(stream.subspan(offset)) - static_cast<double>(length->extra);
      if (count < 0 || count > static_cast<double>(length->most)) {
        return {Verdict::none};
      }
      middle_bytes = static_cast<std::size_t>(count);
    }
    // Behind a Length, only packets with values have a field at `offset`. The tail follows below.
    offset += bytes_of(field, format_.elements, shape_.counted);
    if (offset > stream.size() || (shape_.counted && offset >= shape_.head_bytes)) {
      break;
    }
  }
  const std::size_t total = shape_.head_bytes + middle_bytes + shape_.tail_bytes;
  if (stream.size() < total) {
    return {Verdict::incomplete};
  }
  const Bytes packet = stream.first(total);
  offset = total - shape_.tail_bytes;
  for (std::size_t i = format_.fields.size() - shape_.tail_fields; i < format_.fields.size(); ++i) {
    const auto* fixed = as<PacketFormat::Fixed>(format_.fields[i]);
    if (fixed != nullptr && !begins_like(packet.subspan(offset), fixed->bytes)) {
      return {Verdict::none};
    }
    offset += bytes_of(format_.fields[i], format_.elements, shape_.counted);
  }
  return {checksum_is_right(packet) ? Verdict::whole : Verdict::wrong_checksum, total};
}

bool PacketDeframer::checksum_is_right(Bytes packet) const {
  // Offsets count from the packet's beginning, but in the tail from its end.
  std::size_t offset = 0;
  for (std::size_t i = 0; i < format_.fields.size(); ++i) {
    if (i == format_.fields.size() - shape_.tail_fields) {
      offset = packet.size() - shape_.tail_bytes;
    }
    if (const auto* check = as<PacketFormat::Check>(format_.fields[i])) {
      const std::size_t bytes = check->checksum.bytes();
      const NumberType type{NumberType::Kind::unsigned_integer, static_cast<std::uint8_t>(bytes),
                            check->big_endian};
      const std::size_t begin = check->after ? offset + bytes : check->from_byte;
      const std::size_t end = check->after ? packet.size() : offset;
      return type.read(packet.subspan(offset)) ==
             check->checksum.of_stretch(running_[at_ + begin], running_[at_ + end], end - begin);
    }
    offset += bytes_of(format_.fields[i], format_.elements, shape_.counted);
  }
  return true;
}

std::vector<Bytes> PacketDeframer::locate_fields(Bytes packet) const {
  const std::size_t middle_bytes = packet.size() - shape_.head_bytes - shape_.tail_bytes;
  std::vector<Bytes> places;
  std::size_t offset = 0;
  for (const PacketFormat::Field& field : format_.fields) {
    std::size_t bytes = bytes_of(field, format_.elements, shape_.counted);
    if (shape_.counted && as<PacketFormat::Parts>(field) != nullptr) {
      bytes += middle_bytes - shape_.middle_bytes;
    }
    places.push_back(packet.subspan(offset, bytes));
    offset += bytes;
  }
  return places;
}

PacketDeframer::Meaning PacketDeframer::interpret(Bytes packet, std::vector<ParsedFrame>& frames) {
  std::size_t offset = 0;
  for (std::size_t i = 0; i < shape_.head_fields; ++i) {
    const auto* only = as<PacketFormat::Only>(format_.fields[i]);
    if (only != nullptr && !begins_like(packet.subspan(offset), only->bytes)) {
      return Meaning::other;
    }
    offset += bytes_of(format_.fields[i], format_.elements, shape_.counted);
  }
  const std::size_t least = shape_.head_bytes + shape_.middle_bytes + shape_.tail_bytes;
  if (packet.size() < least || (packet.size() > least && !shape_.parts)) {
    return Meaning::malformed;
  }
  const std::vector<Bytes> places = locate_fields(packet);
  time_s_.reset();
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (const auto* only = as<PacketFormat::Only>(format_.fields[i])) {
      if (!begins_like(places[i], only->bytes)) {
        return Meaning::other;
      }
    } else if (const auto* time = as<PacketFormat::Time>(format_.fields[i])) {
      time_s_ = time->type.read(places[i]) * time->tick_s;
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (const auto* values = as<PacketFormat::Values>(format_.fields[i])) {
      read_values(*values, places[i], frames);
    } else if (const auto* parts = as<PacketFormat::Parts>(format_.fields[i])) {
      if (!are_parts(places[i])) {
        return Meaning::malformed;
      }
      read_parts(*parts, places[i], frames);
    }
  }
  return Meaning::values;
}

void PacketDeframer::read_values(const PacketFormat::Values& field, Bytes bytes,
                                 std::vector<ParsedFrame>& frames) {
  values_.clear();
  for (std::size_t element = 0; element < format_.elements; ++element) {
    const Bytes stride = bytes.subspan(element * field.stride_bytes);
    append_value(field.type.read(stride.subspan(field.at_byte)));
  }
  complete_frame(frames);
}

bool PacketDeframer::are_parts(Bytes bytes) const {
  while (!bytes.empty()) {
    const std::size_t part_bytes = parts_[bytes[0]].bytes;
    if (part_bytes == 0 || part_bytes > bytes.size()) {
      return false;
    }
    bytes = bytes.subspan(part_bytes);
  }
  return true;
}

void PacketDeframer::read_parts(const PacketFormat::Parts& field, Bytes bytes,
                                std::vector<ParsedFrame>& frames) {
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

void PacketDeframer::append_value(double number) {
  const double value = format_.gain * number + format_.offset;
  values_.push_back(std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN());
}

void PacketDeframer::complete_frame(std::vector<ParsedFrame>& frames) {
  frames.push_back({values_, time_s_});
  values_.clear();
}

}  // namespace palpate
