#include "estimation/bounded/device_bin_likelihood.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/contact_evidence.hpp"
#include "estimation/kernel_sizes.hpp"
#include "shaders/evaluate_boxes.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

using gpu::Access;

/// Bins of a row that an invocation takes: few enough for registers, and as many as small boxes are
/// wide.
constexpr std::uint32_t run_bins = 5;
/// Tables and results of a dispatch are no larger, where the device has more.
constexpr std::size_t most_table_bytes = 16 << 20;
/// Elements of a dispatch: up to two iterations of the kernel's loops each, as many again for the
/// segments and the search of the box.
constexpr std::size_t most_elements = gpu::most_iterations / 4;

std::uint32_t runs_of(const BinBox& box) {
  return static_cast<std::uint32_t>(box.y_count) * groups_of(box.x_count, run_bins);
}

/// Makes a buffer hold `bytes`.
void reserve(gpu::Context& context, gpu::Buffer& buffer, std::size_t bytes, const char* purpose,
             VkFormat texel = VK_FORMAT_UNDEFINED) {
  if (buffer.bytes() < bytes) {
    buffer = {};
    buffer = gpu::Buffer(context, bytes, gpu::Memory::device, purpose, texel);
  }
}

}  // namespace

DeviceBinLikelihood::DeviceBinLikelihood(gpu::Context& context,
                                         std::span<const Hypothesis> hypotheses,
                                         const ContactModel& contact, const PoseLattice& lattice)
    : context_(context),
      stream_(context),
      lattice_(lattice),
      contact_table_(context, stream_, contact),
      group_of_(hypotheses.size()),
      place_of_(hypotheses.size()) {
  const gpu::Limits& limits = context.limits();
  const std::size_t bytes =
      std::min<std::size_t>({most_table_bytes, limits.storage_range, limits.allocation});
  // Every run of bins may hold a single one.
  most_bins_ = std::min<std::size_t>(
      bytes / sizeof(float), std::size_t{limits.group_count[0]} * independent_lanes(limits));
  most_rotated_ =
      std::min<std::size_t>(limits.table_texels, bytes / sizeof(shaders::RotatedElement));
  for (const MapGroup& group : group_maps(context, hypotheses, lattice)) {
    for (std::size_t i = 0; i < group.objects.size(); ++i) {
      group_of_[group.objects[i]] = groups_.size();
      place_of_[group.objects[i]] = i;
    }
    groups_.push_back(make_group(group, hypotheses, *contact.prior));
  }
  for (const Access access : {Access::storage, Access::table}) {
    const auto uses = [&](const Group& group) { return group.kind.access == access; };
    if (std::any_of(groups_.begin(), groups_.end(), uses)) {
      kernels_[access == Access::table ? 1 : 0] = make_kernel(access, contact);
    }
  }
  const KnownElements nothing{.from_pivot_mm = {{0.0, 0.0}}};
  const BinBox bin{.y_count = 1, .x_count = 1};
  for (const Group& group : groups_) {
    Piece piece{.box = bin};
    piece.box.object = static_cast<std::int32_t>(group.objects.front());
    std::span<const Piece> pieces(&piece, 1);
    const Portion portion{.begin = 0, .end = 1};
    dispatch(group, fill(group, pieces, portion, nothing), portion);
  }
  stream_.run();
}

DeviceBinLikelihood::Group DeviceBinLikelihood::make_group(const MapGroup& group,
                                                           std::span<const Hypothesis> hypotheses,
                                                           double prior) {
  std::vector<shaders::BoxPlace> places;
  int first_node = 0;
  shaders::uint first_axis = 0;
  for (const std::size_t object : group.objects) {
    const OccupancyGrid& map = hypotheses[object].compared();
    const int width = map.nx + 2 * shaders::MAP_BORDER;
    const int height = map.ny + 2 * shaders::MAP_BORDER;
    places.push_back({.first_node = first_node,
                      .map_width = width,
                      .map_height = height,
                      .first_table_node = contact_table_.first_node(object),
                      .x_axis = first_axis,
                      .y_axis = first_axis + static_cast<shaders::uint>(lattice_.x_mm.count)});
    first_node += width * height;
    first_axis += static_cast<shaders::uint>(lattice_.x_mm.count + lattice_.y_mm.count);
  }
  const std::vector<std::uint32_t> no_bins(hypotheses.size());
  return {group,
          MapTable(context_, stream_, group, hypotheses, lattice_, no_bins, prior, contact_table_),
          std::move(places)};
}

gpu::Kernel DeviceBinLikelihood::make_kernel(Access maps, const ContactModel& contact) {
  std::vector<std::uint32_t> constants = contact_constants(context_.limits(), contact);
  constants.push_back(maps == Access::table ? 1U : 0U);
  constants.push_back(run_bins);
  return {context_,
          {.name = "evaluate_boxes",
           .spirv = shaders::evaluate_boxes,
           .bindings = {Access::table, Access::table, Access::table, Access::table, Access::storage,
                        Access::storage, Access::storage, Access::storage},
           .push_bytes = sizeof(shaders::BoxPush),
           .constants = constants}};
}

void DeviceBinLikelihood::move_pivot(const glm::dvec2& pivot_mm) { lattice_.pivot_mm = pivot_mm; }

std::vector<DeviceBinLikelihood::Piece> DeviceBinLikelihood::pieces_of(
    const Group& group, std::span<const BinBox> boxes, std::size_t most_bins) const {
  std::vector<Piece> pieces;
  std::size_t first_bin = 0;
  for (const BinBox& box : boxes) {
    if (&groups_[group_of_[box.object]] == &group) {
      // Whole rows, or parts of one: their bins stand together among the results.
      const auto columns = static_cast<std::int32_t>(std::min<std::size_t>(box.x_count, most_bins));
      const auto rows = static_cast<std::int32_t>(
          std::max<std::size_t>(1, most_bins / static_cast<std::size_t>(box.x_count)));
      for (std::int32_t y = 0; y < box.y_count; y += std::min(rows, box.y_count - y)) {
        for (std::int32_t x = 0; x < box.x_count; x += std::min(columns, box.x_count - x)) {
          Piece piece{box, first_bin + static_cast<std::size_t>(y) * box.x_count + x};
          piece.box.y_first += y;
          piece.box.y_count = std::min(rows, box.y_count - y);
          piece.box.x_first += x;
          piece.box.x_count = std::min(columns, box.x_count - x);
          pieces.push_back(piece);
        }
      }
    }
    first_bin += static_cast<std::size_t>(box.bins());
  }
  return pieces;
}

std::vector<DeviceBinLikelihood::Portion> DeviceBinLikelihood::portions_of(
    const KnownElements& elements) const {
  const std::size_t most = std::min(most_elements, most_rotated_);
  std::vector<Portion> portions;
  for (const ReadingRun& run : elements.runs) {
    for (std::size_t e = run.begin; e < run.end;) {
      if (portions.empty() || portions.back().end - portions.back().begin == most) {
        portions.push_back({.begin = e, .end = e});
      }
      Portion& portion = portions.back();
      const std::size_t end = std::min(run.end, portion.begin + most);
      portion.segments.push_back({.begin = static_cast<shaders::uint>(e - portion.begin),
                                  .end = static_cast<shaders::uint>(end - portion.begin),
                                  .reading = static_cast<shaders::uint>(run.reading),
                                  .instead = shaders::UNKNOWN});
      portion.end = end;
      e = end;
    }
  }
  return portions;
}

std::size_t DeviceBinLikelihood::most_bins_for(std::size_t elements) const {
  const double most_work = work_per_run(context_.limits()) / static_cast<double>(elements);
  return std::min(most_bins_, std::max<std::size_t>(1, static_cast<std::size_t>(most_work)));
}

DeviceBinLikelihood::Batch DeviceBinLikelihood::fill(const Group& group,
                                                     std::span<const Piece>& pieces,
                                                     const Portion& portion,
                                                     const KnownElements& elements) const {
  const std::size_t count = portion.end - portion.begin;
  const std::size_t most_bins = most_bins_for(count);
  const auto from = std::span(elements.from_pivot_mm).subspan(portion.begin, count);
  Batch batch;
  std::int32_t theta = -1;
  while (!pieces.empty()) {
    const BinBox& box = pieces.front().box;
    const bool turned = box.theta != theta;
    if (!batch.places.empty() && (batch.bins + static_cast<std::size_t>(box.bins()) > most_bins ||
                                  (turned && batch.rotated.size() + count > most_rotated_))) {
      break;
    }
    if (turned) {
      theta = box.theta;
      const double theta_rad = lattice_.theta_rad.centre(theta);
      const auto rotated = rotate_evidence(from, {theta_rad, theta_rad, 1}, group.kind.cell_mm);
      batch.rotated.insert(batch.rotated.end(), rotated.begin(), rotated.end());
    }
    shaders::BoxPlace place = group.places[place_of_[box.object]];
    place.first_element = static_cast<shaders::uint>(batch.rotated.size() - count);
    place.x_axis += static_cast<shaders::uint>(box.x_first);
    place.y_axis += static_cast<shaders::uint>(box.y_first);
    place.x_count = static_cast<shaders::uint>(box.x_count);
    place.first_run = batch.runs;
    place.first_bin = batch.bins;
    batch.places.push_back(place);
    batch.runs += runs_of(box);
    batch.bins += static_cast<std::uint32_t>(box.bins());
    pieces = pieces.subspan(1);
  }
  return batch;
}

void DeviceBinLikelihood::dispatch(const Group& group, const Batch& batch, const Portion& portion) {
  reserve(context_, results_, batch.bins * sizeof(float), "bins");
  reserve(context_, rotated_, batch.rotated.size() * sizeof(shaders::RotatedElement),
          "rotated elements", VK_FORMAT_R32G32B32A32_SINT);
  reserve(context_, boxes_, batch.places.size() * sizeof(shaders::BoxPlace), "boxes");
  reserve(context_, segments_,
          std::max<std::size_t>(1, portion.segments.size()) * sizeof(shaders::Segment), "segments",
          VK_FORMAT_R32G32B32A32_SINT);
  stream_.upload(rotated_, batch.rotated);
  stream_.upload(boxes_, batch.places);
  if (!portion.segments.empty()) {
    stream_.upload(segments_, portion.segments);
  }
  const shaders::BoxPush push{.runs = batch.runs,
                              .boxes = static_cast<shaders::uint>(batch.places.size()),
                              .segments = static_cast<shaders::uint>(portion.segments.size())};
  const MapTable& maps = group.maps;
  stream_.dispatch(
      kernels_[group.kind.access == Access::table ? 1 : 0],
      {&segments_, &contact_table_.nodes(), &rotated_, maps.nodes().read_as(Access::table),
       maps.nodes().read_as(Access::storage), &maps.axes(), &boxes_, &results_},
      push, {groups_of(batch.runs, independent_lanes(context_.limits())), 1, 1});
}

void DeviceBinLikelihood::evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                                   std::span<float> log_likelihood) {
  std::fill(log_likelihood.begin(), log_likelihood.end(), 0.0F);
  const std::vector<Portion> portions = portions_of(elements);
  // Sums of several portions are rounded once.
  std::vector<double> sums(portions.size() > 1 ? log_likelihood.size() : 0);
  std::vector<float> evaluated;
  for (const Group& group : groups_) {
    for (const Portion& portion : portions) {
      const std::vector<Piece> pieces =
          pieces_of(group, boxes, most_bins_for(portion.end - portion.begin));
      std::span<const Piece> left(pieces);
      while (!left.empty()) {
        const Piece* piece = left.data();
        const Batch batch = fill(group, left, portion, elements);
        dispatch(group, batch, portion);
        evaluated.resize(batch.bins);
        stream_.download(results_, evaluated);
        stream_.run();
        const float* from = evaluated.data();
        for (; piece != left.data(); ++piece) {
          for (std::int64_t i = 0; i < piece->box.bins(); ++i, ++from) {
            if (sums.empty()) {
              log_likelihood[piece->first_bin + i] = *from;
            } else {
              sums[piece->first_bin + i] += *from;
            }
          }
        }
      }
    }
  }
  std::transform(sums.begin(), sums.end(), log_likelihood.begin(),
                 [](double sum) { return static_cast<float>(sum); });
}

std::uint64_t DeviceBinLikelihood::device_bytes() const {
  std::uint64_t bytes = contact_table_.nodes().bytes() + results_.bytes() + rotated_.bytes() +
                        boxes_.bytes() + segments_.bytes();
  for (const Group& group : groups_) {
    bytes += group.maps.device_bytes();
  }
  return bytes;
}

}  // namespace palpate
