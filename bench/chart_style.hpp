#pragma once

#include <string>

namespace palpate::bench {

/// CSS of charts in a page, for light and for dark surroundings. The colours are those of Okabe and
/// Ito (2008), which the colour-blind tell apart, some made darker or lighter for contrast.
std::string chart_style();

/// The light one without variables, for charts in files: many a viewer knows none, and would draw
/// in black.
std::string file_style();

}  // namespace palpate::bench
