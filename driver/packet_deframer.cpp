#include "packet_deframer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {

namespace {

using Bytes = std::span<const std::uint8_t>;

/// Whether the two agree as far as `bytes` goes.
bool begins_like(Bytes bytes, const std::vector<std::uint8_t>& pattern) {
  const std::size_t known = std::min(bytes.size(), pattern.size());
  return std::equal(pattern.begin(), pattern.begin() + static_cast<std::ptrdiff_t>(known),
                    bytes.begin());
}

/// Index of the first element whose value the part carries.
std::size_t first_element(const PacketFormat::Parts& field, const PacketFormat::Part& part) {
  std::size_t element = 0;
  for (const PacketFormat::Part* before = field.parts.data(); before != &part; ++before) {
    element += before->values;
  }
  return element;
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
    checked_ = checked_ || as<PacketFormat::Check>(field) != nullptr;
  }
}

void PacketDeframer::reset() {
  buffer_.clear();
  at_ = 0;
  in_step_ = true;
  values_.clear();
}

void PacketDeframer::push(Bytes bytes, std::vector<ParsedFrame>& frames) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  while (at_ < buffer_.size() && take_step(frames)) {
  }
  // A terminator that has been consumed still tells where the next packet begins.
  const std::size_t history = std::min(at_, terminator_.size());
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(at_ - history));
  at_ = history;
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
  if (!in_step_ && !checked_) {
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
    if (!checked_) {
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
    // Fields behind a Length lie where they do only in packets with values; the tail comes below.
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
  // Its place counts from the beginning in the head, from the end in the tail.
  std::size_t offset = 0;
  for (std::size_t i = 0; i < format_.fields.size(); ++i) {
    if (i == format_.fields.size() - shape_.tail_fields) {
      offset = packet.size() - shape_.tail_bytes;
    }
    if (const auto* check = as<PacketFormat::Check>(format_.fields[i])) {
      const std::size_t bytes = check->checksum.bytes();
      const NumberType type{NumberType::Kind::unsigned_integer, static_cast<std::uint8_t>(bytes),
                            check->big_endian};
      const Bytes covered = check->after
                                ? packet.subspan(offset + bytes)
                                : packet.subspan(check->from_byte, offset - check->from_byte);
      return type.read(packet.subspan(offset)) == check->checksum(covered);
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
  const std::size_t before = frames.size();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto* values = as<PacketFormat::Values>(format_.fields[i]);
    const auto* parts = as<PacketFormat::Parts>(format_.fields[i]);
    if ((values != nullptr && !read_values(*values, places[i], frames)) ||
        (parts != nullptr && !read_parts(*parts, places[i], frames))) {
      frames.resize(before);
      return Meaning::malformed;
    }
  }
  return Meaning::values;
}

bool PacketDeframer::read_values(const PacketFormat::Values& field, Bytes bytes,
                                 std::vector<ParsedFrame>& frames) {
  values_.clear();
  for (std::size_t element = 0; element < format_.elements; ++element) {
    const Bytes stride = bytes.subspan(element * field.stride_bytes);
    if (!append_value(field.type.read(stride.subspan(field.at_byte)))) {
      return false;
    }
  }
  complete_frame(frames);
  return true;
}

bool PacketDeframer::read_parts(const PacketFormat::Parts& field, Bytes bytes,
                                std::vector<ParsedFrame>& frames) {
  const auto end = field.parts.end();
  while (!bytes.empty()) {
    const auto part = std::find_if(field.parts.begin(), end, [&](const PacketFormat::Part& p) {
      return (bytes[0] & p.mask) == (p.tag & p.mask);
    });
    if (part == end || bytes.size() < bytes_of(field, *part)) {
      return false;
    }
    if (part->values > 0) {
      const std::size_t place = first_element(field, *part);
      if (place == 0) {
        values_.clear();
      }
      if (values_.size() != place) {
        values_.clear();  // the part before this one was lost, and the frame with it
      } else if (!read_part(field, *part, bytes)) {
        return false;
      } else if (values_.size() == format_.elements) {
        complete_frame(frames);
      }
    }
    bytes = bytes.subspan(bytes_of(field, *part));
  }
  return true;
}

bool PacketDeframer::read_part(const PacketFormat::Parts& field, const PacketFormat::Part& part,
                               Bytes bytes) {
  for (std::size_t i = 0; i < part.values; ++i) {
    if (!append_value(field.type.read(bytes.subspan(1 + i * field.type.bytes)))) {
      return false;
    }
  }
  return true;
}

bool PacketDeframer::append_value(double number) {
  values_.push_back(format_.gain * number + format_.offset);
  return std::isfinite(values_.back());
}

void PacketDeframer::complete_frame(std::vector<ParsedFrame>& frames) {
  frames.push_back({values_, time_s_});
  values_.clear();
}

}  // namespace palpate
