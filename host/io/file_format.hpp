#pragma once

#include <string_view>

#include "io/hdf5_contents.hpp"

namespace palpate {

inline constexpr std::string_view recording_format = "palpate.recording";
inline constexpr std::string_view map_format = "palpate.map";
inline constexpr std::string_view posterior_format = "palpate.posterior";
/// Version of every format; readers refuse a higher version.
inline constexpr int format_version = 1;

/// Throws Error unless the attributes `format` and `version` name this format.
void require_format(const Hdf5Contents& file, std::string_view format);

}  // namespace palpate
