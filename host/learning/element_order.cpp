#include "learning/element_order.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>

#include "learning/array_place.hpp"

namespace palpate {

namespace {

/// Where the elements are a full grid, the eight orders in which it may be read.
std::vector<ElementOrder> orders_of(std::span<const glm::dvec2> elements_mm) {
  constexpr double same_mm = 1e-6;
  const auto less = [](double a, double b) { return a < b - same_mm; };
  std::set<double, decltype(less)> xs(less);
  std::set<double, decltype(less)> ys(less);
  for (const glm::dvec2& p : elements_mm) {
    xs.insert(p.x);
    ys.insert(p.y);
  }
  const std::vector<double> x(xs.begin(), xs.end());
  const std::vector<double> y(ys.begin(), ys.end());
  std::vector<ElementOrder> orders;
  if (x.size() < 2 || y.size() < 2 || x.size() * y.size() != elements_mm.size()) {
    return orders;
  }
  for (const bool by_rows : {true, false}) {
    for (const char* first : {"bottom-left", "bottom-right", "top-left", "top-right"}) {
      const bool right = std::string_view(first).ends_with("right");
      const bool top = std::string_view(first).starts_with("top");
      std::vector<glm::dvec2> order;
      for (std::size_t e = 0; e < elements_mm.size(); ++e) {
        const std::size_t i = by_rows ? e % x.size() : e / y.size();
        const std::size_t j = by_rows ? e / x.size() : e % y.size();
        order.emplace_back(x[right ? x.size() - 1 - i : i], y[top ? y.size() - 1 - j : j]);
      }
      orders.push_back({{fmt::format("first-element {}", first),
                         fmt::format("order {}", by_rows ? "rows" : "columns")},
                        std::move(order)});
    }
  }
  return orders;
}

/// Whether a turn of one array about its middle by a multiple of a right angle makes the other.
bool turns_into(std::span<const glm::dvec2> a, std::span<const glm::dvec2> b) {
  constexpr double same_mm = 1e-6;
  const glm::dvec2 middle = array_centre_mm(a);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Pose turn{{}, quarter * std::numbers::pi / 2.0};
    const auto turned = [&](const glm::dvec2& p) { return middle + turn * (p - middle); };
    if (std::ranges::equal(
            a, b, [&](auto& p, auto& q) { return glm::distance(turned(p), q) < same_mm; })) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<ElementOrder> orders_but_for_turns(std::span<const glm::dvec2> elements_mm) {
  std::vector<ElementOrder> kept{{{}, {elements_mm.begin(), elements_mm.end()}}};
  for (ElementOrder& order : orders_of(elements_mm)) {
    if (std::ranges::none_of(kept, [&](const ElementOrder& other) {
          return turns_into(other.elements_mm, order.elements_mm);
        })) {
      kept.push_back(std::move(order));
    }
  }
  return kept;
}

SetupFinding order_finding(const std::vector<std::string>& options, double nats) {
  return {"element_order", nats,
          fmt::format("the elements are read in another order: import with `{}`",
                      fmt::join(options, "` and `")),
          options};
}

void check_order(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check) {
  const auto orders = orders_of(setup.elements_mm);
  if (orders.empty()) {
    check.remarks.emplace_back("the array is no grid: the order of its elements was not tried");
    return;
  }
  const std::vector<glm::dvec2> given = setup.elements_mm;
  double best = nats;
  std::vector<std::string> options;
  for (const auto& [import_options, elements_mm] : orders) {
    Setup other = setup;
    other.elements_mm = elements_mm;
    const double tried = elements_mm == given ? nats : judge.nats(other);
    if (tried > best) {
      best = tried;
      options = import_options;
      check.elements_mm = elements_mm;
    }
  }
  // Where touches overlap little, how the elements lie among the cells tells orders apart by a
  // little; a wrong order costs a good part of all that the touches tell.
  if (best - nats > std::max(least_nats, least_share * std::abs(nats))) {
    check.findings.push_back(order_finding(options, best - nats));
    setup.elements_mm = check.elements_mm;
    nats = best;
  }
  check.elements_mm = setup.elements_mm;
}

}  // namespace palpate
