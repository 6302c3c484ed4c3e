#include "driver/deframer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace palpate {

PacketDeframer::PacketDeframer(PacketFormat format) : format_(std::move(format)) {
  if (format_.check) {
    sums_.emplace(format_.check->checksum);
  }
}

void PacketDeframer::push(Bytes bytes, std::vector<Frame>& frames) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  if (sums_) {
    sums_->push(bytes);
  }
  while (at_ < buffer_.size() && take_step(frames)) {
  }
  // The last terminator stays: it tells where the next packet begins.
  const std::size_t consumed = at_ - std::min(at_, format_.terminator.size());
  // Erase once half of the buffer is consumed: erasing at each push would move the rest each time.
  if (2 * consumed >= buffer_.size()) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(consumed));
    if (sums_) {
      sums_->erase(consumed);
    }
    at_ -= consumed;
  }
}

bool PacketDeframer::take_step(std::vector<Frame>& frames) {
  if (!in_step_ && !follows_terminator()) {
    return drop_byte();
  }
  const Bytes stream = Bytes(buffer_).subspan(at_);
  const std::optional<std::size_t> bytes = format_.packet_bytes(stream);
  if (!bytes) {
    return drop_byte();
  }
  if (*bytes > stream.size()) {
    return false;
  }
  const Bytes packet = stream.first(*bytes);
  if (!checksum_is_right(packet)) {
    counters_.checksum_errors += in_step_ ? 1 : 0;
    return drop_byte();
  }
  if (!in_step_ && !format_.check) {
    const Bytes next = stream.subspan(packet.size());
    if (!begins_like(next, format_.preamble)) {
      return drop_byte();
    }
    if (next.size() < format_.preamble.size()) {
      return false;
    }
  }
  if (!decode(packet, frames)) {
    values_.clear();
    if (!format_.check) {
      return drop_byte();
    }
    counters_.garbage_bytes += packet.size();
  }
  at_ += packet.size();
  in_step_ = true;
  return true;
}

bool PacketDeframer::drop_byte() {
  if (in_step_) {
    values_.clear();
    time_s_.reset();
  }
  in_step_ = false;
  ++at_;
  ++counters_.garbage_bytes;
  return true;
}

bool PacketDeframer::follows_terminator() const {
  const std::size_t bytes = format_.terminator.size();
  return at_ >= bytes &&
         begins_like(Bytes(buffer_).subspan(at_ - bytes, bytes), format_.terminator);
}

bool PacketDeframer::checksum_is_right(Bytes packet) const {
  if (!sums_) {
    return true;
  }
  const PacketFormat::Check& check = *format_.check;
  const std::size_t begin = format_.begin_of(check.place, packet.size());
  const std::size_t from = check.after ? begin + check.place.bytes : check.from_byte;
  const std::size_t end = check.after ? packet.size() : begin;
  const NumberType type{.bytes = static_cast<std::uint8_t>(check.checksum.bytes),
                        .big_endian = check.big_endian};
  return type.read(packet.subspan(begin)) == sums_->of(at_ + from, at_ + end);
}

bool PacketDeframer::decode(Bytes packet, std::vector<Frame>& frames) {
  const auto behind = [&](const PacketFormat::Place& place) {
    return packet.subspan(format_.begin_of(place, packet.size()));
  };
  const auto is_passed_over = [&](std::size_t up_to_byte) {
    return std::ranges::any_of(format_.only, [&](const PacketFormat::Pattern& only) {
      return only.place.offset < up_to_byte && !begins_like(behind(only.place), only.bytes);
    });
  };
  if (is_passed_over(format_.head_bytes())) {
    return true;
  }
  if (packet.size() < format_.bytes || (packet.size() > format_.bytes && !format_.parts)) {
    return false;
  }
  if (is_passed_over(format_.bytes)) {
    return true;
  }
  if (format_.time) {
    read_clock(format_.time->clock, behind(format_.time->place));
  }
  if (const auto& values = format_.values) {
    const Bytes bytes = behind(values->place);
    for (std::size_t element = 0; element < format_.elements; ++element) {
      append_value(
          values->type.read(bytes.subspan(element * values->stride_bytes + values->at_byte)));
    }
    complete_frame(frames);
    return true;
  }
  const PacketFormat::Place& place = format_.parts->place;
  if (!find_parts(packet.subspan(place.offset, place.bytes + packet.size() - format_.bytes))) {
    return false;
  }
  // A clock is that of all parts of its packet.
  for (const FoundPart& found : found_) {
    if (found.part->clock) {
      read_clock(*found.part->clock, found.content);
    }
  }
  for (const FoundPart& found : found_) {
    read_part(found, frames);
  }
  return true;
}

bool PacketDeframer::find_parts(Bytes bytes) {
  const std::vector<PacketFormat::Part>& known = format_.parts->list;
  found_.clear();
  while (!bytes.empty()) {
    const auto part = std::ranges::find_if(known, [&](const PacketFormat::Part& candidate) {
      return ((bytes[0] ^ candidate.tag) & candidate.mask) == 0;
    });
    if (part == known.end()) {
      break;
    }
    if (part->bytes > bytes.size()) {
      return false;
    }
    found_.push_back({&*part, bytes.subspan(1)});
    bytes = bytes.subspan(part->bytes);
  }
  return !found_.empty();
}

void PacketDeframer::read_clock(const PacketFormat::Clock& clock, Bytes bytes) {
  const double ticks = clock.type.read(bytes);
  const double tick_s = clock.tick_s > 0.0 ? clock.tick_s : tick_of(ticks);
  time_s_ = tick_s > 0.0 ? std::optional(tick_s * ticks) : std::nullopt;
}

double PacketDeframer::tick_of(double ticks) {
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

void PacketDeframer::read_part(const FoundPart& found, std::vector<Frame>& frames) {
  const auto& [part, content] = found;
  if (part->values == 0) {
    return;
  }
  if (values_.size() != part->first_element) {
    values_.clear();  // a part was lost, and the frame with it
  }
  if (values_.size() == part->first_element) {
    const NumberType& type = format_.parts->type;
    for (std::size_t i = 0; i < part->values; ++i) {
      append_value(type.read(content.subspan(i * type.bytes)));
    }
  }
  if (values_.size() == format_.elements) {
    complete_frame(frames);
  }
}

void PacketDeframer::append_value(double number) {
  const double value = format_.gain * number + format_.offset;
  values_.push_back(std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN());
}

void PacketDeframer::complete_frame(std::vector<Frame>& frames) {
  frames.push_back({.device_time_s = time_s_, .values = values_});
  values_.clear();
  time_s_.reset();
}

}  // namespace palpate
