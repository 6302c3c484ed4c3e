// Touches of uncertain pose, and objects that slip between touches.

#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "beliefs.hpp"
#include "likelihood_cases.hpp"
#include "support/least_limits.hpp"

namespace palpate {

namespace {

/// One object has twice the weight of the other; 40 elements over [-6, 6]^2 mm.
LikelihoodCase displaced(std::string name, const PoseLattice& lattice, const DisplacementSd& touch,
                         const DisplacementSd& slip = {}) {
  return {.name = std::move(name),
          .objects = {{random_map(31, 27, 0.5, 12.0, 71), 2.0},
                      {random_map(23, 29, 0.5, 12.0, 72), 1.0}},
          .recording = random_recording(2, 40, 73),
          .lattices = {lattice},
          .options = {.lattice = {}, .none_weight = 3.0, .touch_sd = touch, .slip_sd = slip},
          .nats = per_mean,
          .path = ""};
}

/// Without a floor, log-likelihoods are thousands of nats, of which float32 keeps 6 digits.
LikelihoodCase without_floor(LikelihoodCase of) {
  of.name += "WithoutAFloor";
  of.options.contact.gamma = 0.0;
  of.nats = 5e-3;
  return of;
}

/// The least limits that Vulkan promises, but 1 / part of the texels and workgroups.
std::function<void(gpu::Limits&)> least(std::uint32_t part) {
  return [part](gpu::Limits& limits) {
    limits = gpu::least_limits(limits);
    limits.table_texels /= part;
    for (std::uint32_t& count : limits.group_count) {
      count /= part;
    }
  };
}

/// Small lattices: around some bins a Gaussian lies inside, and at the edges it is cut off.
std::vector<LikelihoodCase> on_every_lattice() {
  const PoseLattice plain = small_lattice();
  PoseLattice part = plain;
  part.theta_rad = {0.4, 2.2, 9};
  PoseLattice one_theta = plain;
  one_theta.theta_rad = {0.7, 0.7, 1};
  PoseLattice one_x = plain;
  one_x.x_mm = {1.5, 1.5, 1};
  PoseLattice wide_x = plain;
  wide_x.x_mm = {-5.0, 6.0, 1};
  PoseLattice one_y = plain;
  one_y.y_mm = {-0.5, -0.5, 1};
  // A step of theta moves the array by 2 mm.
  PoseLattice far = plain;
  far.pivot_mm = {-600.0, 800.0};
  far.theta_rad = {0.7, 0.718, 9};
  // Without a floor a single element may cost a thousand nats: neighbouring bins, of small steps
  // too, and neighbouring planes then lie farther apart than a float's range.
  const PoseLattice fine{
      .x_mm = {-1.8, 1.8, 27}, .y_mm = {-0.7, 0.7, 9}, .theta_rad = {0, 0.39, 7}};
  const PoseLattice planes{.x_mm = {-5.0, 5.0, 7},
                           .y_mm = {-5.0, 5.0, 6},
                           .theta_rad = {0, two_pi, 40},
                           .pivot_mm = {3.0, -2.0}};
  const DisplacementSd sd{.mm = 1.0, .rad = 0.2};
  std::vector<LikelihoodCase> cases{
      displaced("AtRest", plain, {}),
      displaced("Uncertain", plain, sd),
      displaced("Slipping", plain, {}, sd),
      displaced("UncertainAndSlipping", plain, {.mm = 0.8, .rad = 0.1}, {.mm = 0.7, .rad = 0.3}),
      displaced("OnPartOfTheCircle", part, sd, sd),
      displaced("OnASingleTheta", one_theta, sd, sd),
      displaced("OnAFixedXBelowTheSteps", one_x, {.mm = 0.2, .rad = 0.1}, {.mm = 0.2, .rad = 0.1}),
      displaced("OnOneWideBinOfX", wide_x, sd, sd),
      displaced("OnAFixedYAlongThetaAlone", one_y, {.rad = 0.3}, {.rad = 0.3}),
      displaced("AboutAPivotAMetreAway", far, {.mm = 1.0, .rad = 0.002}, {.mm = 1.0, .rad = 0.002}),
      displaced("AsWideAsTheRegion", part, {.mm = 9.0, .rad = 1.5}, {.mm = 9.0, .rad = 1.5})};
  for (LikelihoodCase& of : cases) {
    of.recording = random_recording(of.lattices[0].bins() == plain.bins() ? 3 : 2, 40, 73);
  }
  const DisplacementSd fine_sd{.mm = 0.4, .rad = 0.04};
  cases.push_back(without_floor(displaced("UncertainOnFineBins", fine, fine_sd)));
  cases.push_back(without_floor(displaced("SlippingOnFineBins", fine, {}, fine_sd)));
  cases.push_back(without_floor(displaced("UncertainAcrossPlanes", planes, sd)));
  cases.push_back(without_floor(displaced("SlippingAcrossPlanes", planes, {}, sd)));
  cases.push_back(without_floor(displaced("AtRest", plain, {})));
  LikelihoodCase& changing =
      cases.emplace_back(displaced("AnUncertainArrayThatChanges", plain, sd));
  changing.recording = changing_array();
  // So far out that the array misses the objects at many bins, and at all.
  for (const auto& [name, x_mm, touch_sd] :
       {std::tuple("MissingManyBins", 17.0, DisplacementSd{.mm = 0.5, .rad = 0.1}),
        {"MissingManyBinsAtRest", 17.0, {}},
        {"MissingAllAtRest", 100.0, {}}}) {
    LikelihoodCase& of = cases.emplace_back(displaced(name, plain, touch_sd));
    for (Pose& pose : of.recording.T_robot_sensor) {
      pose.translation_mm = 0.3 * pose.translation_mm + glm::dvec2(x_mm, 1.0);
    }
  }
  return cases;
}

}  // namespace

std::vector<LikelihoodCase> displaced_cases() {
  std::vector<LikelihoodCase> cases = on_every_lattice();
  // 900 elements tell planes apart by hundreds of nats, floor or not.
  for (const auto& [gamma, name] :
       {std::pair(0.1, "900Elements"), {1e-6, "900ElementsTinyFloor"}}) {
    PoseLattice lattice = small_lattice();
    lattice.x_mm.count = lattice.y_mm.count = 6;
    LikelihoodCase& of = cases.emplace_back(displaced(name, lattice, {.mm = 1.0, .rad = 0.2}));
    of.recording = random_recording(1, 900, 74);
    of.options.contact.gamma = gamma;
    // Rounding of a touch's own likelihood grows with its elements, 1e-4 nats for 36.
    of.nats += per_touch * 900.0 / 36.0;
  }
  // A neighbour's weight is down to exp(-800), its likelihood up to exp(1e4) times a bin's.
  for (const double steps_of_sd : {4.0, 9.0, 12.5, 13.3, 14.5, 20.0, 37.0, 40.0}) {
    for (const auto& [mm, rad] : {std::pair(1.0, 1.0), std::pair(1.0, 0.0), std::pair(0.0, 1.0)}) {
      if (mm != rad && steps_of_sd != 9.0 && steps_of_sd != 14.5) {
        continue;  // one axis after another at two widths alone
      }
      const PoseLattice lattice{
          .x_mm = {-5.0, 6.0, 9}, .y_mm = {-3.0, 3.0, 5}, .theta_rad = {0.0, two_pi, 12}};
      LikelihoodCase& of = cases.emplace_back(without_floor(
          displaced(fmt::format("A{:.0f}thOfAStep{}{}", 10 * steps_of_sd, mm, rad), lattice,
                    {.mm = mm * lattice.x_mm.step() / steps_of_sd,
                     .rad = rad * lattice.theta_rad.step() / steps_of_sd})));
      of.recording = random_recording(1, 900, 85);
      of.nats = 1e-2;
    }
  }
  // Weights beyond 32 bins stand in a table, not in the kernel. Even and odd numbers of bins.
  for (const int count : {100, 101}) {
    const PoseLattice along_x{
        .x_mm = {-5.0, 5.0, count}, .y_mm = {-5.0, 5.0, 5}, .theta_rad = {0.0, two_pi, 3}};
    PoseLattice along_y = along_x;
    std::swap(along_y.x_mm, along_y.y_mm);
    cases.push_back(displaced(fmt::format("FarAlong{}FineBins", count), along_x, {.mm = 1.0}));
    cases.back().lattices.push_back(along_y);
  }
  // An object's bins in slabs of 13 and 11 thetas, and of 9, 9 and 6; a Gaussian reaches 4 or 5.
  // The circle, whose last theta neighbours its first, and a part of it, which ends.
  for (const double planes : {13.2, 9.2}) {
    const PoseLattice circle{
        .x_mm = {-5.0, 6.0, 17}, .y_mm = {-3.0, 3.0, 9}, .theta_rad = {0.0, two_pi, 24}};
    LikelihoodCase& of =
        cases.emplace_back(displaced(fmt::format("InSlabsOf{:.0f}Thetas", planes), circle,
                                     {.mm = 1.0, .rad = 0.2}, {.mm = 0.5, .rad = 0.2}));
    of.lattices.push_back(circle);
    of.lattices.back().theta_rad.upper = 4.0;
    of.lower = [bytes = static_cast<VkDeviceSize>(planes * 17 * 9) * 8](gpu::Limits& limits) {
      limits.storage_range = bytes;
    };
  }
  // The limits are a tenth of the least, so that a tenth of the bins passes them. At 1,700 thetas
  // the planes of four objects are more than a table's texels and a dispatch's workgroups.
  struct LongAxis {
    const char* name;
    int x;
    int theta;
    DisplacementSd sd;
    std::size_t touches;
  };
  for (const auto& [name, x, theta, sd, touches] :
       {LongAxis{"LeastLimitsOfManyThetas", 1, 1700, {.rad = 9e-4}, 1},
        LongAxis{"LeastLimitsOfFarAlongTheta", 1, 400, {.rad = 0.25}, 2},
        LongAxis{"LeastLimitsOfManyAlongX", 7000, 1, {.mm = 0.1}, 1}}) {
    const PoseLattice lattice{
        .x_mm = {-5.0, 6.0, x}, .y_mm = {0.0, 0.0, 1}, .theta_rad = {0.0, two_pi, theta}};
    LikelihoodCase& of = cases.emplace_back(displaced(name, lattice, sd, sd));
    if (theta > 1000) {
      of.objects.insert(of.objects.end(), {of.objects[0], of.objects[1]});
    }
    of.recording = random_recording(touches, 8, 195);
    of.lower = least(10);
  }
  return cases;
}

}  // namespace palpate
