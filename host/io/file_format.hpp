#pragma once

#include <string_view>

#include "hdf5_contents.hpp"

namespace palpate {

inline constexpr std::string_view recording_format = "palpate.recording";
inline constexpr std::string_view map_format = "palpate.map";
inline constexpr std::string_view posterior_format = "palpate.posterior";
/// Of every format; readers refuse a higher one.
inline constexpr int format_version = 1;

/// Throws Error unless the attributes `format` and `version` say that this is such a file.
void require_format(const Hdf5Contents& file, std::string_view format);

}  // namespace palpate
