#include "driver/packet_layout.hpp"

#include <utility>

namespace palpate {

PacketLayout::PacketLayout(PacketFormat format)
    : format_(std::move(format)),
      shape_(shape_of(format_)),
      shifted_from_(fields().size() - shape_.tail_fields) {
  if (const auto* first = as<PacketFormat::Fixed>(fields().front())) {
    preamble_ = first->bytes;
  } else if (const auto* last = as<PacketFormat::Fixed>(fields().back())) {
    terminator_ = last->bytes;
  }
  for (const PacketFormat::Field& field : fields()) {
    offsets_.push_back(whole_bytes_);
    whole_bytes_ += bytes_of(field, format_.elements, shape_.counted);
    if (const auto* check = as<PacketFormat::Check>(field)) {
      check_ = check;
      check_field_ = offsets_.size() - 1;
    } else if (as<PacketFormat::Parts>(field) != nullptr) {
      shifted_from_ = std::min(shifted_from_, offsets_.size());
    }
  }
}

std::size_t PacketLayout::begin_of(std::size_t field, std::size_t packet_bytes) const {
  return offsets_[field] + (field < shifted_from_ ? 0 : packet_bytes - whole_bytes_);
}

PacketLayout::Bytes PacketLayout::place_of(std::size_t field, Bytes packet) const {
  std::size_t bytes = bytes_of(fields()[field], format_.elements, shape_.counted);
  if (shape_.counted && as<PacketFormat::Parts>(fields()[field]) != nullptr) {
    bytes = packet.size() - whole_bytes_;
  }
  return packet.subspan(begin_of(field, packet.size()), bytes);
}

PacketLayout::CheckPlace PacketLayout::check_place(std::size_t packet_bytes) const {
  const std::size_t offset = begin_of(check_field_, packet_bytes);
  return check_->after ? CheckPlace{offset, offset + check_->checksum.bytes(), packet_bytes}
                       : CheckPlace{offset, check_->from_byte, offset};
}

PacketLayout::Packet PacketLayout::packet_at_front(Bytes stream) const {
  std::size_t total = whole_bytes_;
  // Behind a Length, only packets with values have a field at its offset. The tail follows below.
  const std::size_t known = shape_.counted ? shape_.head_fields : fields().size();
  for (std::size_t i = 0; i < known && offsets_[i] <= stream.size(); ++i) {
    const Bytes rest = stream.subspan(offsets_[i]);
    if (const auto* fixed = as<PacketFormat::Fixed>(fields()[i])) {
      if (!begins_like(rest, fixed->bytes)) {
        return {Packet::Fit::none};
      }
    } else if (const auto* length = as<PacketFormat::Length>(fields()[i])) {
      if (rest.size() < length->type.bytes) {
        return {Packet::Fit::incomplete};
      }
      const double count = length->type.read(rest) - static_cast<double>(length->extra);
      if (count < 0 || count > static_cast<double>(length->most)) {
        return {Packet::Fit::none};
      }
      total += static_cast<std::size_t>(count) - shape_.middle_bytes;
    }
  }
  if (stream.size() < total) {
    return {Packet::Fit::incomplete};
  }
  for (std::size_t i = fields().size() - shape_.tail_fields; i < fields().size(); ++i) {
    const auto* fixed = as<PacketFormat::Fixed>(fields()[i]);
    if (fixed != nullptr &&
        !begins_like(stream.first(total).subspan(begin_of(i, total)), fixed->bytes)) {
      return {Packet::Fit::none};
    }
  }
  return {Packet::Fit::whole, total};
}

}  // namespace palpate
