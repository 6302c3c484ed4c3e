#include "estimation/contact_kernel.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include "estimation/kernel_sizes.hpp"
#include "palpate/error.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

// Eight factors of at least this multiply to 1e-24, and the kernel's clamp of the odds at 2^-30
// changes them by less than one part in 1e6.
constexpr double least_product_floor = 1e-3;

std::uint32_t bits(double value) { return std::bit_cast<std::uint32_t>(static_cast<float>(value)); }

std::size_t nodes_of_a_set(const ContactModel& model) {
  return model.table ? model.table->levels() * model.table->nodes : 0;
}

/// The log-likelihoods [level, node] of one set.
void append_set(std::vector<shaders::TableNode>& nodes, const LikelihoodTable& table,
                std::span<const double> log_likelihood) {
  for (std::size_t level = 0; level < table.levels(); ++level) {
    const std::span<const double> row = log_likelihood.subspan(level * table.nodes, table.nodes);
    for (std::size_t i = 0; i < table.nodes; ++i) {
      nodes.push_back({.nats = static_cast<float>(row[i]),
                       .rise = static_cast<float>(row[std::min(i + 1, table.nodes - 1)] - row[i])});
    }
  }
}

}  // namespace

std::vector<std::uint32_t> contact_constants(const gpu::Limits& limits, const ContactModel& model) {
  const std::uint32_t lanes = independent_lanes(limits);
  if (const auto& table = model.table) {
    const double nodes_per_nat =
        static_cast<double>(table->nodes - 1) / (table->last_log_odds - table->first_log_odds);
    return {lanes,
            shaders::AS_TABLE,
            0,
            0,
            bits(table->first_log_odds),
            bits(nodes_per_nat),
            static_cast<std::uint32_t>(table->nodes)};
  }
  const double floor = model.gamma * model.prior.value();
  const bool as_logs = !(floor >= least_product_floor);
  // A product of two small numbers may be 0 where both logarithms are sound.
  const double log_floor =
      model.gamma > 0.0 ? std::log(model.gamma) + std::log(*model.prior) : shaders::NO_FLOOR;
  return {lanes,
          as_logs ? shaders::AS_LOGS : shaders::AS_PRODUCTS,
          bits(as_logs ? log_floor : floor),
          bits(1.0 - model.gamma),
          0,
          0,
          0};
}

ContactTable::ContactTable(gpu::Context& context, gpu::CommandStream& stream,
                           const ContactModel& model)
    : nodes_of_a_set_(nodes_of_a_set(model)) {
  const std::uint64_t count =
      std::max<std::uint64_t>(1, (model.table ? model.table->sets() : 0) * nodes_of_a_set_);
  const std::uint64_t most = std::min<std::uint64_t>(
      context.limits().table_texels, context.limits().allocation / sizeof(shaders::TableNode));
  if (count > most) {
    throw Error(
        Fault::input,
        fmt::format("likelihood table: its {} nodes on the device exceed the {} that device '{}' "
                    "reads; use fewer nodes, levels or objects",
                    count, most, context.name()));
  }
  std::vector<shaders::TableNode> nodes;
  if (const auto& table = model.table) {
    sets_ = table->sets();
    const std::size_t numbers = table->levels() * table->nodes;
    for (std::size_t set = 0; set < sets_; ++set) {
      append_set(nodes, *table, std::span(table->log_likelihood).subspan(set * numbers, numbers));
    }
  }
  nodes.resize(count);
  nodes_ = stream.uploaded(nodes, "the likelihood table", VK_FORMAT_R32G32_SFLOAT);
}

int ContactTable::first_node(std::size_t object) const {
  return static_cast<int>((sets_ == 1 ? 0 : object) * nodes_of_a_set_);
}

}  // namespace palpate
