#pragma once

#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "learning/setup_check.hpp"
#include "learning/setup_judge.hpp"

namespace palpate {

/// The elements in the order of their readings, and the options of an import that say so.
struct ElementOrder {
  std::vector<std::string> options;
  std::vector<glm::dvec2> elements_mm;
};

/// The order as given, without options, and those of a full grid that no turn of an array makes.
std::vector<ElementOrder> orders_but_for_turns(std::span<const glm::dvec2> elements_mm);

/// The finding "element_order" of these options.
SetupFinding order_finding(const std::vector<std::string>& options, double nats);

/// Where an order costs less than this part of all that touches tell, it is not told from others.
inline constexpr double least_share = 0.05;

/// Adds the order of the elements that explains the touches better, if any, and goes on from it.
void check_order(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check);

}  // namespace palpate
