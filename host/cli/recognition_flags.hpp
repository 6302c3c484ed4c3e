#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "recognition/recognition_job.hpp"

namespace palpate::cli {

// What the command line asks of a recognition fills a Request, which makes a RecognitionJob.

/// Adds the flags of maps, sensor, lattice and filter, and --verbose.
void add_recognition_flags(CLI::App& command, Request& request, bool& verbose);

/// Adds the flags that select unknowns from recordings.
void add_selection_flags(CLI::App& command, Request& request);

/// Adds the flag of one option. Its Errors name flag, value and what to give instead.
/// @param help "": the option's own
void add_option_flag(CLI::App& command, Request& request, std::string_view name,
                     const std::string& help = "");

/// Opens the job's filter, then tells the task's remarks: bins that do not fit deserve only their
/// refusal. Throws Error.
/// @param cancel_point see FilterResources
Recogniser open_telling(const RecognitionJob& job, const std::function<void()>& cancel_point = {});

/// Adds the files that the task of a completed request was read from.
void add_recognition_files(const Request& request, CommandFiles& files);

}  // namespace palpate::cli
