#pragma once

#include <string_view>

#include "io/hdf5_contents.hpp"
#include "io/hdf5_writer.hpp"
#include "palpate/touch.hpp"

namespace palpate {

inline constexpr std::string_view recording_format = "palpate.recording";
inline constexpr std::string_view map_format = "palpate.map";
inline constexpr std::string_view posterior_format = "palpate.posterior";
/// Version of every format but that of posteriors of some bins; readers refuse a higher version.
inline constexpr int format_version = 1;
/// Version of a posterior of some bins.
inline constexpr int evaluated_version = 2;

/// Datasets of a recording with a row for each touch or frame. `time` is last: see FrameRecorder.
inline constexpr const char* row_names[] = {"pressure", "sensor_pose", "device_time", "lost_before",
                                            "time"};

/// Throws Error unless the attributes `format` and `version` name this format.
/// @param newest version that is known
/// @returns the version
int require_format(const Hdf5Contents& file, std::string_view format, int newest = format_version);
/// Writes these attributes.
void write_format(Hdf5Writer& file, std::string_view format, int version = format_version);

/// Writes the attributes of a recording: its format, texts and truth.
void write_head(Hdf5Writer& file, const Recording& head);

}  // namespace palpate
