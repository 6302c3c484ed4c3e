#include "cli/recognition_flags.hpp"

#include <CLI/CLI.hpp>

#include "cli/options.hpp"

namespace palpate::cli {

void add_recognition_flags(CLI::App& command, RecognitionFlags& flags) {
  command.add_option("--maps", flags.maps, "Maps of the known objects, or folders of maps");
  command.add_option(
      "--scene", flags.scene,
      "Scene file (YAML); its keys are array, sensor_model, threshold, ratio, gamma, prior, "
      "touch_sd, slip_sd, none, objects, region, bins, filter and device, and a flag overrides its "
      "key");
  command.add_option(
      "--sensor-model", flags.sensor_model,
      "What 'palpate calibrate' learned about the sensor (YAML): the threshold, the ratio, gamma "
      "and the touches' standard deviations, which flags and scene keys override; a likelihood "
      "table in the place of gamma and prior; and how sure to be: the temperature, press features, "
      "and whether the object was learned at all. Without an own --filter, standard deviations "
      "above 0 take the histogram; --filter bounded and particles leave them out "
      "[default: no model]");
  command.add_option(
      "--bins", flags.bins,
      "Pose bins per object along x, y and theta, as 25x25x16; auto: as many as the refined pose "
      "needs, in steps of 0.6 times the maps' cell or 1.2 times the sensor's spread, whichever is "
      "larger; fine: also as the mode needs, in steps of 0.6 times the larger of both. Auto and "
      "fine take wider steps where the histogram's device memory is short; the region about an "
      "automatic "
      "pivot "
      "fits the largest array of all RECORDINGs [default: auto, or 25x25x16 where "
      "a range or a pivot is given]");
  command.add_option("--x-mm", flags.x_mm,
                     "Range of the pivot's x in the object frame, mm, as --x-mm=-10:10 [default: "
                     "every place of an array that touches an object of the maps, or -10:10 where "
                     "counts of --bins, another range or a pivot X,Y is given]");
  command.add_option("--y-mm", flags.y_mm, "Range of the pivot's y [default: as for --x-mm]");
  command.add_option(
      "--theta-deg", flags.theta_deg,
      "Range of theta, degrees, at most 360 wide [default: 0:360]; 30:30 fixes theta at 30");
  command.add_option(
      "--pivot-mm", flags.pivot_mm,
      "Point X,Y in the robot frame, mm, about which theta turns; the bins' x and y are the "
      "point's coordinates in the object frame. auto: the array's centre at the first touch of "
      "each unknown with an element in contact [default: auto, or 0,0 where counts of --bins or a "
      "range is given]");
  command.add_option("--prior", flags.prior,
                     "Probability that an unseen cell is occupied; refused beside a sensor model "
                     "with a table [default: the maps' own]");
  command.add_option("--gamma", flags.gamma,
                     "Probability that an element's contact class is random; refused beside a "
                     "sensor model with a table [default: the sensor model's, or 0.1]");
  add_uncertainty_flags(command, flags.uncertainty);
  command.add_option(
      "--threshold", flags.threshold,
      "Contact threshold, in the recording's pressure unit [default: the sensor model's, or 2 kPa; "
      "required for raw pressure without a model]");
  command.add_option("--ratio", flags.ratio,
                     "Threshold as a fraction of the touch's largest pressure [default: the sensor "
                     "model's, or 0.3]");
  add_filter_flags(command, flags.filter);
  command.add_option("--device", flags.device, "Vulkan device, by index or a part of its name");
  command.add_flag("--verbose", flags.verbose,
                   "Say on standard error how the device works: its memory, the likelihood's path, "
                   "the lattice, the seconds it took");
}

}  // namespace palpate::cli
