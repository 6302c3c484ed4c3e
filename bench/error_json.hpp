#pragma once

#include <optional>

#include <nlohmann/json.hpp>

#include "filter_run.hpp"

namespace palpate::bench {

/// A summary of pose errors as every document holds it; null where there is none.
inline nlohmann::ordered_json json_of(const std::optional<ErrorSummary>& error) {
  if (!error) {
    return nullptr;
  }
  return {{"mean", error->mean_mm}, {"median", error->median_mm}, {"p95", error->p95_mm}};
}

}  // namespace palpate::bench
