#pragma once

#include <string>

namespace palpate::bench {

/// @throws Error where there is no gnuplot to run
void require_gnuplot();

/// Runs a gnuplot script; what gnuplot has to say goes to standard error.
/// @throws Error where gnuplot fails
void run_gnuplot(const std::string& script);

/// A path as a gnuplot string.
std::string gnuplot_quoted(const std::string& path);

}  // namespace palpate::bench
