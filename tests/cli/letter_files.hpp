#pragma once

#include <filesystem>
#include <string>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate {

/// Runs the program beside files of two letters: A.h5 and I.h5, touches to learn from; the maps
/// maps/A.map.h5 and maps/I.map.h5; u.h5, touches of an unknown that is an A.
class LetterFiles : public ProgramTest {
 protected:
  LetterFiles() {
    std::filesystem::create_directory(folder_ / "maps");
    for (const std::string letter : {"A", "I"}) {
      write_recording(folder_ / (letter + ".h5"), sample_training(letter, 48));
      write_map(folder_ / "maps" / (letter + ".map.h5"), sample_map(letter));
    }
    write_recording(folder_ / "u.h5", unknown_);
  }

  Recording unknown_ = sample_unknown("A", {{2.0, -3.0}, 1.0}, 6);
};

}  // namespace palpate
