#include "driver/frame_decoder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace palpate {

FrameDecoder::FrameDecoder(const PacketLayout& layout) : layout_(layout) {
  for (const PacketFormat::Field& field : layout.fields()) {
    if (const auto* parts = as<PacketFormat::Parts>(field)) {
      know_parts(*parts);
    }
  }
}

void FrameDecoder::know_parts(const PacketFormat::Parts& parts) {
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

void FrameDecoder::forget_frame() {
  values_.clear();
  time_s_.reset();
}

void FrameDecoder::reset() {
  forget_frame();
  last_ticks_.reset();
}

FrameDecoder::Meaning FrameDecoder::take(Bytes packet, std::vector<ParsedFrame>& frames) {
  const std::vector<PacketFormat::Field>& fields = layout_.fields();
  const PacketShape& shape = layout_.shape();
  for (std::size_t i = 0; i < shape.head_fields; ++i) {
    const auto* only = as<PacketFormat::Only>(fields[i]);
    if (only != nullptr && !begins_like(layout_.place_of(i, packet), only->bytes)) {
      return Meaning::other;
    }
  }
  if (packet.size() < layout_.whole_bytes() ||
      (packet.size() > layout_.whole_bytes() && !shape.parts)) {
    return Meaning::malformed;
  }
  time_s_ = shape.parts ? time_s_ : std::nullopt;  // parts may come behind the clock's packet
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

void FrameDecoder::read_values(const PacketFormat::Values& field, Bytes bytes,
                               std::vector<ParsedFrame>& frames) {
  values_.clear();
  for (std::size_t element = 0; element < layout_.format().elements; ++element) {
    const Bytes stride = bytes.subspan(element * field.stride_bytes);
    append_value(field.type.read(stride.subspan(field.at_byte)));
  }
  complete_frame(frames);
}

/// The parts in front of the first whose tag is not known; none where a part is cut short.
FrameDecoder::Bytes FrameDecoder::known_parts(Bytes bytes) const {
  std::size_t known = 0;
  while (known < bytes.size() && parts_[bytes[known]].bytes > 0) {
    known += parts_[bytes[known]].bytes;
  }
  return known <= bytes.size() ? bytes.first(known) : Bytes();
}

/// Reads the clock that a part may hold; it is that of all parts of its packet.
void FrameDecoder::read_time(Bytes bytes) {
  for (; !bytes.empty(); bytes = bytes.subspan(parts_[bytes[0]].bytes)) {
    if (const auto& time = parts_[bytes[0]].time) {
      const double ticks = time->type.read(bytes.subspan(1));
      const double tick_s = time->tick_s > 0.0 ? time->tick_s : tick_of(ticks);
      time_s_ = tick_s > 0.0 ? std::optional(tick_s * ticks) : std::nullopt;
    }
  }
}

/// The unit of a clock that does not state it, from its first step; 0 where it is not known yet.
double FrameDecoder::tick_of(double ticks) {
  const double step = ticks - last_ticks_.value_or(ticks);
  last_ticks_ = ticks;
  const double period_s = layout_.format().period_s;
  if (tick_s_ == 0.0 && step > 0.0 && period_s > 0.0) {
    const auto misfit = [&](double tick_s) { return std::abs(std::log(step * tick_s / period_s)); };
    tick_s_ = std::ranges::min(std::array{1e-3, 1e-6, 1e-9}, {}, misfit);
  }
  return tick_s_;
}

void FrameDecoder::read_parts(const PacketFormat::Parts& field, Bytes bytes,
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
        if (values_.size() == layout_.format().elements) {
          complete_frame(frames);
        }
      }
    }
    bytes = bytes.subspan(part.bytes);
  }
}

void FrameDecoder::append_value(double number) {
  const double value = layout_.format().gain * number + layout_.format().offset;
  values_.push_back(std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN());
}

void FrameDecoder::complete_frame(std::vector<ParsedFrame>& frames) {
  frames.push_back({values_, time_s_});
  forget_frame();
}

}  // namespace palpate
