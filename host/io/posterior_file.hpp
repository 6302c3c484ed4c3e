#pragma once

#include <filesystem>
#include <functional>
#include <span>

#include "palpate/files.hpp"

namespace palpate {

/// Reads and checks a "palpate.posterior" HDF5 file, holding a few MB of it at a time.
/// @param head called with the posterior without log-likelihoods
/// @param log_likelihood called with the log-likelihoods, object by object, in pieces
/// @throws Error as read_posterior() does
void scan_posterior(const std::filesystem::path& path,
                    const std::function<void(const Posterior&)>& head,
                    const std::function<void(std::span<const double>)>& log_likelihood);

}  // namespace palpate
