#pragma once

#include <array>
#include <string>
#include <vector>

#include "figures/chart.hpp"
#include "table.hpp"

namespace palpate::bench {

// The sweep's document as people read it.

// Columns of the document's tables.
std::vector<Column> run_columns();
inline constexpr std::size_t printed_run_columns = 20;  ///< the first; the page has more
std::vector<Column> precision_columns();
std::vector<Column> bounds_columns();
std::vector<Column> limit_columns();
std::vector<Column> step_columns();
std::vector<Column> verdict_columns();

/// The steps of all knees.
Json steps_of(const Json& document);

/// The files of the charts, without their endings, in the order of charts_of().
inline constexpr std::array chart_names{"sweep_front", "sweep_precision", "sweep_bins",
                                        "sweep_bounds"};
std::vector<Chart> charts_of(const Json& document);

/// The document as one self-contained page, by the template in sweep_page.html.
std::string page_of(const Json& document);

}  // namespace palpate::bench
