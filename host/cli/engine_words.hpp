#pragma once

#include <string>

#include "recognition/recogniser.hpp"

namespace palpate::cli {

/// Maps, bins or particles, and device in a short line.
std::string setup_words(const Device& device, const RecognitionTask& task);
/// Prints on standard error how the device works: its memory, the filter with its paths through the
/// likelihood, the lattice.
/// @param device null where none is used
void print_engine(const Device* device, const Recogniser& recogniser, const RecognitionTask& task);

}  // namespace palpate::cli
