#include "recognition_flags.hpp"

#include <CLI/CLI.hpp>

#include "options.hpp"

namespace palpate::cli {

void add_recognition_flags(CLI::App& command, RecognitionFlags& flags) {
  command.add_option("--maps", flags.maps, "Maps of the known objects, or folders of maps");
  command.add_option("--scene", flags.scene,
                     "Scene file (YAML) with any of: array, threshold, ratio, gamma, prior, "
                     "none, objects, region, bins, filter, device; a flag overrides its key");
  command.add_option("--bins", flags.bins,
                     "Pose bins per object along x, y and theta [default: 25x25x16]; auto: as "
                     "many as the maps' cells and the sensor's spread are worth and the device "
                     "holds");
  command.add_option("--x-mm", flags.x_mm, "Range of x, mm, as --x-mm=-10:10 [default: -10:10]");
  command.add_option("--y-mm", flags.y_mm, "Range of y, mm, as --y-mm=-10:10 [default: -10:10]");
  command.add_option("--theta-deg", flags.theta_deg,
                     "Range of theta, degrees [default: 0:360]; a fixed angle, 30:30, is one bin");
  command.add_option("--pivot-mm", flags.pivot_mm,
                     "Point X,Y in the robot frame, mm, that theta turns about and whose place in "
                     "the object frame x and y are [default: 0,0]");
  command.add_option("--prior", flags.prior,
                     "Probability that an unseen cell is occupied [default: the maps' own]");
  command.add_option("--gamma", flags.gamma,
                     "Rate at which a contact reading is random [default: 0.1]");
  command.add_option("--none", flags.none,
                     "Prior weight of \"(none)\", an object that was never learned, where each "
                     "map's is 1 or its scene's: with 5 maps, 5 makes it as likely as not; its "
                     "likelihood is that of a map of nothing but the prior [default: left out]");
  command.add_option("--threshold", flags.threshold,
                     "Contact threshold, in the pressure's own unit [default: 2 kPa; must be "
                     "given for raw pressure]");
  command.add_option("--ratio", flags.ratio,
                     "Contact threshold as a part of the touch's largest pressure [default: 0.3]");
  command.add_option("--filter", flags.filter,
                     "auto, histogram or particles; auto is histogram [default: auto]");
  command
      .add_option("--particles", flags.particles,
                  "Particles over all objects together, up to 1,000,000 [default: 10000]")
      ->check(require_whole_number);
  command.add_option("--resampling", flags.resampling,
                     "multinomial or systematic [default: multinomial]");
  command.add_flag("--augmented", flags.augmented,
                   "Augmented MCL: add random particles where the touches fit worse than before");
  command.add_option("--seed", flags.seed, "Seed of the particles' random numbers [default: 0]")
      ->check(require_whole_number);
  command
      .add_option("--memory-mib", flags.memory_mib,
                  "Most memory of the device to take, MiB [default: all of it]; less costs time")
      ->check(require_whole_number);
  command.add_option("--device", flags.device, "Vulkan device, by index or a part of its name");
}

}  // namespace palpate::cli
