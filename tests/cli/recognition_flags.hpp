#pragma once

#include <gmock/gmock.h>
#include <CLI/CLI.hpp>

#include "cli/recognition_flags.hpp"
#include "model/option_words.hpp"
#include "options/option.hpp"
#include "recognition/recognition_job.hpp"
#include "support/sample_files.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::cli {

using Flags = std::vector<std::string>;

/// Recognitions of six touches of an A, as the command line or a scene asks for them. Nothing
/// starts the program.
class RecognitionFlags : public testing::Test {
 protected:
  RecognitionFlags() {
    for (const char* label : {"A", "I"}) {
      write_map(folder_ / (label + std::string(".map.h5")), sample_map(label));
    }
    // What a folder of maps may hold beside them.
    put_bytes(folder_ / "notes.txt", "not a map");
    write_recording(folder_ / "u.h5", recording_);
    write_sensor_model(folder_ / "s.yaml", {.classifier = {.threshold = 5.0, .ratio = 0.6},
                                            .gamma = 0.3,
                                            .touch_sd = {.mm = 1.0, .rad = 0.0},
                                            .temperature = 4.0});
  }

  /// The completed request of these flags and, where there is any, of this scene.
  Request request_of(Flags flags, const std::string& scene = "") const {
    if (!scene.empty()) {
      put_bytes(folder_ / "scene.yaml", scene);
      flags.push_back("--scene=" + (folder_ / "scene.yaml").string());
    }
    CLI::App app;
    Request request;
    bool verbose = false;
    add_recognition_flags(app, request, verbose);
    add_selection_flags(app, request);
    app.parse(Flags(flags.rbegin(), flags.rend()));
    return complete(request);
  }
  /// The same of the maps' folder.
  RecognitionJob job(Flags flags, const std::string& scene = "",
                     const std::string& every_bin_for = "") const {
    flags.push_back("--maps=" + folder_.path().string());
    return {request_of(flags, scene), std::vector{recording_}, {.every_bin_for = every_bin_for}};
  }
  /// What the command says of flags that it refuses.
  std::string refusal(const Flags& flags, const std::string& scene = "",
                      const std::string& every_bin_for = "") const {
    return in_flags(input_error([&] { job(flags, scene, every_bin_for).open(); }));
  }

  ScratchFolder folder_;
  Recording recording_ = sample_unknown("A", {{2.0, -3.0}, 1.0}, 6);
};

}  // namespace palpate::cli
