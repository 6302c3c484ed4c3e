#pragma once

#include <filesystem>
#include <functional>
#include <span>

#include "palpate/files.hpp"

namespace palpate {

/// Reads a "palpate.posterior" HDF5 file, holding a few MB of it at a time, and checks all of it.
/// @param head is given the posterior without log-likelihoods
/// @param log_likelihood is given those, object by object, in pieces
/// @throws Error as read_posterior() does
void scan_posterior(const std::filesystem::path& path,
                    const std::function<void(const Posterior&)>& head,
                    const std::function<void(std::span<const double>)>& log_likelihood);

}  // namespace palpate
