#pragma once

#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "recognition/touch_sd_fit.hpp"

namespace palpate::cli {

/// A flag that --fit-touch-sd cannot stand beside, and whether it was given.
struct OtherFlag {
  const char* name;
  bool given = false;
};

/// Throws Error where one of the flags was given, and as require_fittable().
void refuse_beside_fit(std::span<const OtherFlag> flags, const RecognitionTask& task);

/// The result as a table and the flags to paste.
std::string touch_sd_text(const TouchSdFit& fit);
/// The result in the form that other programs rely on.
nlohmann::ordered_json to_json(const TouchSdFit& fit, const std::string& device);

}  // namespace palpate::cli
