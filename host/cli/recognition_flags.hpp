#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/filter_flags.hpp"
#include "cli/uncertainty_flags.hpp"
#include "io/command_files.hpp"
#include "palpate/scene.hpp"
#include "recognition/recogniser.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

/// Says a sentence to the user, on standard error, its options as flags.
void tell_on_stderr(const std::string& sentence);

/// A map in memory, and its name for messages.
struct GivenMap {
  std::string name;
  Hypothesis hypothesis;
};

/// The flags of a task, as given.
struct RecognitionFlags {
  std::vector<std::string> maps;
  std::vector<GivenMap> given_maps;  ///< of a program, in the place of `maps`
  std::string scene;
  std::string bins;
  std::string x_mm;
  std::string y_mm;
  std::string theta_deg;
  std::string pivot_mm;
  std::string sensor_model;
  std::optional<double> prior;
  std::optional<double> gamma;
  UncertaintyFlags uncertainty;
  std::optional<double> threshold;
  std::optional<double> ratio;
  FilterFlags filter;
  std::string device;
  bool verbose = false;
  std::function<void(const std::string&)> tell = tell_on_stderr;
};

void add_recognition_flags(CLI::App& command, RecognitionFlags& flags);

/// The scene file that the flags name, or an empty scene. Throws Error.
Scene scene_of(const RecognitionFlags& flags);

/// Replaces the source's array by the scene's, where the scene has an array. Throws Error where the
/// two differ in their number of elements.
void replace_array(const Scene& scene, const std::string& scene_file, const std::string& source,
                   std::size_t elements, std::vector<glm::dvec2>& elements_mm);

/// The task that the flags and the scene file ask for; a flag overrides the scene's key. Reads the
/// maps. Throws Error.
/// @param pressure_unit of the touches to come, which `source` gives
/// @param reach_mm of the arrays that touch; see array_reach_mm()
/// @param need why the command needs the histogram, if it does
RecognitionTask task_of(const RecognitionFlags& flags, const Scene& scene,
                        const std::string& pressure_unit, const std::string& source,
                        double reach_mm, const HistogramNeed& need = {});

/// The device that the flags or the scene name; "" where neither does.
std::string device_of(const RecognitionFlags& flags, const Scene& scene);
/// Opens it. Throws Error.
Device open_device(const RecognitionFlags& flags, const Scene& scene);

/// Whether neither bins nor any part of a region are given: the region then follows from the maps
/// and the touches' arrays (reach_mm).
bool infers_region(const RecognitionFlags& flags, const Scene& scene);

/// The bins that flags or the scene give where they do not infer the region; what they leave open
/// is PoseLattice's. The pivot is (0, 0) where it is automatic. Throws Error.
PoseLattice given_lattice(const RecognitionFlags& flags, const Scene& scene);
bool has_auto_pivot(const RecognitionFlags& flags, const Scene& scene);

/// Chooses what the task leaves open: the bins of --bins auto or fine, by the device's memory, and
/// the filter of --filter auto. Returns the sentences that tell where a limit made bins wider than
/// the maps resolve, and where they are wider than the sensor model's. Throws Error.
std::vector<std::string> settle_task(const RecognitionFlags& flags, const Scene& scene,
                                     const Device& device, RecognitionTask& task);

/// Makes the task's filter, after --bins auto or fine has chosen the bins and --filter auto the
/// filter. Tells the sentences of settle_task(). Throws Error.
Recogniser open_recogniser(const RecognitionFlags& flags, const Scene& scene, Device& device,
                           RecognitionTask& task);

/// Adds the files that the task was read from: the scene, its array, the sensor model and the maps.
void add_recognition_files(const RecognitionFlags& flags, const Scene& scene,
                           const RecognitionTask& task, CommandFiles& files);

}  // namespace palpate::cli
