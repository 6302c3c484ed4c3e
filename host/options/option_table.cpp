#include <array>
#include <numbers>

#include "options/option.hpp"

namespace palpate {

namespace {

constexpr NumberLimits any{};
constexpr NumberLimits from_0{.least = 0.0};
constexpr NumberLimits from_1{.least = 1.0};
constexpr NumberLimits above_0{.least = 0.0, .with_least = false};
constexpr NumberLimits probability{.least = 0.0, .most = 1.0};
constexpr NumberLimits below_1{.least = 0.0, .most = 1.0, .with_most = false};
constexpr NumberLimits within_0_1{
    .least = 0.0, .most = 1.0, .with_least = false, .with_most = false};
constexpr NumberLimits near{.least = -farthest_mm, .most = farthest_mm};
constexpr double farthest_deg = farthest_mm * 180.0 / std::numbers::pi;
constexpr NumberLimits near_angles{.least = -farthest_deg, .most = farthest_deg};

constexpr const char* general = "Options";
constexpr const char* lattice = "Bins and region";
constexpr const char* likelihood = "Likelihood";
constexpr const char* displaced = "Misplaced touches and slip";
constexpr const char* filter = "Filter";
constexpr const char* device = "Device";

const std::array table{
    Option{"scene", "", general, &Request::scene, any,
           "Scene file (YAML); its keys are array, objects, region (x_mm, y_mm, theta_deg, "
           "pivot_mm), touch_sd and slip_sd (mm, deg), sensor_model, threshold, ratio, gamma, "
           "prior, none, act_below_mm, act_above, bins, filter and device, and a flag overrides "
           "its key"},
    Option{"sensor-model", "sensor_model", general, &Request::sensor_model, any,
           "Sensor model (YAML), what was learned about the sensor: threshold, ratio, gamma, how "
           "far touches are off, a likelihood table, and how sure to be. Flags and scene keys "
           "override it; particles leave the standard deviations of touches out [default: the "
           "sensor.yaml that 'palpate map' wrote beside the maps; none: Eq. 7]"},
    Option{"bins", "bins", lattice, &Request::bins, from_1,
           "Pose bins per object along x, y and theta, as 25x25x16; auto: as many as the refined "
           "pose needs, in steps of 0.6 times the maps' cell or 1.2 times the sensor's spread, "
           "whichever is larger, widened to half of --touch-sd-* or five quarters of --slip-sd-*, "
           "but at most 2.5 times; fine: as many as the mode needs, too, in steps of 0.6 times the"
           " larger of both. Auto and fine take wider steps where the histogram's device memory is"
           " short; the region about an automatic pivot fits the largest array that touches "
           "[default: auto, or 25x25x16 where a range or a pivot is given]"},
    Option{"x-mm", "region.x_mm", lattice, &Request::x_mm, near,
           "Range of the pivot's x in the object frame, mm, as --x-mm=-10:10 [default: every "
           "place of an array that touches an object of the maps, or -10:10 where counts of "
           "--bins, another range or a pivot X,Y is given]"},
    Option{"y-mm", "region.y_mm", lattice, &Request::y_mm, near,
           "Range of the pivot's y [default: as for --x-mm]"},
    Option{"theta-deg", "region.theta_deg", lattice, &Request::theta_deg, near_angles,
           "Range of theta of T_object_robot, degrees, at most 360 wide; --theta-deg=-30:-30 fixes "
           "it, for an object that lies at 30 degrees in the robot frame [default: 0:360]"},
    Option{"pivot-mm", "region.pivot_mm", lattice, &Request::pivot_mm, near,
           "Point X,Y in the robot frame, mm, about which theta turns; the bins' x and y are the "
           "point's coordinates in the object frame. auto: the array's centre at the first touch "
           "of each unknown with an element in contact [default: auto, or 0,0 where counts of "
           "--bins or a range is given]"},
    Option{"prior", "prior", likelihood, &Request::prior, within_0_1,
           "Probability that an unseen cell is occupied; refused beside a sensor model with a "
           "table [default: the maps' own]"},
    Option{"gamma", "gamma", likelihood, &Request::gamma, below_1,
           "Probability that an element's contact class is random; refused beside a sensor model "
           "with a table [default: the sensor model's, or 0.1]"},
    Option{"touch-sd-mm", "touch_sd.mm", displaced, &Request::touch_sd_mm, from_0,
           "The robot's repeatability: standard deviation of the sensor's true position about the "
           "reported one, along x and along y, mm. Independent from touch to touch [default: the "
           "sensor model's, but not with particles; else 0, exact]"},
    Option{"touch-sd-deg", "touch_sd.deg", displaced, &Request::touch_sd_deg, from_0,
           "The same of the sensor's angle, degrees [default: as for --touch-sd-mm]"},
    Option{"slip-sd-mm", "slip_sd.mm", displaced, &Request::slip_sd_mm, from_0,
           "Standard deviation of how far the object moves between two touches, along x and along "
           "y, mm; the motion noise of particles [default: 0, at rest; particles: 1]"},
    Option{"slip-sd-deg", "slip_sd.deg", displaced, &Request::slip_sd_deg, from_0,
           "The same of how far the object turns about its middle, degrees [default: 0; "
           "particles: 5.73, which is 0.1 rad]"},
    Option{"none", "none", general, &Request::none, from_0,
           "Prior weight of \"(none)\", an object that was never learned; a map has the weight 1. "
           "Without W (then write the flag last) it is a ninth of the sum of the maps' "
           "weights: a probability of one in ten before the first touch. A sensor model's "
           "temperature tempers these odds with the evidence. (none) explains each touch by a "
           "piece of some known object; the pieces need not belong to one pose. One touch cannot "
           "tell: after it, the odds are about the prior's, unless a sensor model has learned "
           "what a touch of no known object is like. 0 leaves (none) out, as particles do. By "
           "default it is also left out where the bins are too wide to tell it, or where the "
           "sensor model's temperature is above 5 [default: as without W]"},
    Option{"threshold", "threshold", general, &Request::threshold, from_0,
           "Contact threshold, in the recording's pressure unit [default: the sensor model's, or "
           "2 kPa; required for raw pressure without a model]"},
    Option{"ratio", "ratio", likelihood, &Request::ratio, below_1,
           "Threshold as a fraction of the touch's largest pressure [default: the sensor model's, "
           "or 0.3]"},
    Option{"act-below-mm", "act_below_mm", general, &Request::act_below_mm, above_0,
           "Decide to act where 95 % of the belief lies within this distance of the pose, mm; the "
           "distance is that of the object's points, root mean square [default: 0.5]"},
    Option{"act-above", "act_above", general, &Request::act_above, probability,
           "Decide to act where the best object has at least this probability [default: 0.99]"},
    Option{"filter", "filter", filter, &Request::filter, any,
           "histogram: evaluates every pose bin; bounded: the same bins, but evaluates only those "
           "that matter and proves how little the others can; particles: the paper's particle "
           "filter; auto: bounded, or histogram where objects slip, for --posterior, and where the "
           "search by bounds would take too much memory [default: auto]"},
    Option{"tolerance", "", filter, &Request::tolerance, within_0_1,
           "With --filter bounded: largest share of the belief that may be left unproven; the "
           "search goes on until it is reached. Rounding, which counts as unproven, may exceed a "
           "tolerance below about 1e-8 [default: 1e-6; before the last touch 1e-4 for a trace and "
           "1e-3 for a picture of 'recognize'; a search by a learned sensor ends sooner where it "
           "meets nothing but poor fits]"},
    Option{"budget-ms", "", filter, &Request::budget_ms, above_0,
           "With --filter bounded: milliseconds after which each estimate's search ends and "
           "reports what it has proven by then [default: none]"},
    Option{"evidence-nats", "", filter, &Request::evidence_nats, above_0,
           "With --filter bounded: also bounds the log evidence of every object, however "
           "unlikely, within this many nats [default: only the tolerance counts]"},
    Option{"particles",
           "",
           filter,
           &Request::particles,
           {.least = 1.0, .most = 1'000'000.0},
           "Number of particles of all objects together, up to 1,000,000 [default: 10000]"},
    Option{"resampling", "", filter, &Request::resampling, any,
           "How particles are drawn: multinomial or systematic [default: multinomial]"},
    Option{"augmented", "", filter, &Request::augmented, any,
           "Augmented MCL: add random particles while the touches fit worse than before"},
    Option{"seed", "", filter, &Request::seed, any,
           "Seed of the particles' random numbers [default: 0]"},
    Option{"device", "device", device, &Request::device, any,
           "Vulkan device, by index or a part of its name; a search by bounds needs none"},
    Option{"frames", "", general, &Request::frames, any,
           "Use the touches A to B - 1 of every recording, counted from 0, as A:B", true},
    Option{"touches", "", general, &Request::touches, from_1,
           "Use the first N touches of every recording [default: all]", true},
    Option{"each-frame", "", general, &Request::each_frame, any,
           "Recognise every touch by itself, as an unknown object of its own", true},
    Option{"trace", "", general, &Request::trace, any, "Show the estimate after every touch", true},
};

}  // namespace

std::span<const Option> options() { return table; }

}  // namespace palpate
