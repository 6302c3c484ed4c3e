#include "likelihood_cases.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include <fmt/format.h>

#include "beliefs.hpp"
#include "made_up_sensors.hpp"
#include "shaders/interface.h"
#include "support/made_up_devices.hpp"

namespace palpate {

namespace {

/// As steep as maps of some hundred touches are from cell to cell.
constexpr double steepness = 12.0;
constexpr int sizes[] = {1, 7, 63, 65, 1000};

class Cases {
 public:
  /// One object of 31 x 27 cells, two touches of 36 elements, and lattices that take register tiles
  /// over one cell, over two, and runs of bins.
  LikelihoodCase& add(std::string name) {
    std::erase_if(name, [](char c) { return std::isalnum(c) == 0; });
    all.push_back({.name = std::move(name),
                   .objects = {{random_map(31, 27, 0.5, steepness, 48), 1.0}},
                   .recording = random_recording(2, 36, 42),
                   .lattices = every_way(11, 9),
                   .options = {},
                   .path = ""});
    return all.back();
  }
  static std::vector<PoseLattice> every_way(int nx, int ny) {
    return lattices_of({0.1, 0.15, 0.3, 0.8}, nx, ny, 2);
  }

  std::vector<LikelihoodCase> all;
};

void add_sizes(Cases& cases) {
  for (const int n : sizes) {
    cases.add(fmt::format("BinsAlongX{}", n)).lattices = Cases::every_way(n, 3);
    cases.add(fmt::format("BinsAlongY{}", n)).lattices = Cases::every_way(3, n);
    cases.add(fmt::format("BinsAlongTheta{}", n)).lattices = {
        {.x_mm = {-5.0, 6.0, 7}, .y_mm = {-7.0, 4.0, 5}, .theta_rad = {0.0, two_pi, n}}};
    LikelihoodCase& cells = cases.add(fmt::format("CellsAlongOneAxis{}", n));
    cells.objects = {{random_map(n, 1, 0.5, steepness, 44), 1.0},
                     {random_map(1, n, 0.5, steepness, 45), 1.0},
                     {random_map(n, 3, 0.1, steepness, 46), 1.0},
                     {random_map(3, n, 2.0, steepness, 47), 1.0}};
    cells.lattices = lattices_of({1.6}, 7, 5, 3);
  }
  for (const std::size_t elements : {0U, 1U, 7U, 36U, 37U, 63U, 65U, 256U, 1400U}) {
    LikelihoodCase& of = cases.add(fmt::format("Elements{}", elements));
    of.recording = random_recording(2, elements, 7 + elements);
    // The tolerance is for arrays of 36; the errors of more elements add up.
    of.nats *= std::max(1.0, static_cast<double>(elements) / 36.0);
  }
  LikelihoodCase& one = cases.add("OneBinAndOneElement");
  one.recording = random_recording(1, 1, 452);
  one.lattices = lattices_of({0.1}, 1, 1, 1);
  LikelihoodCase& objects = cases.add("MapsOfDifferentCellsAndWeights");
  objects.objects = {{random_map(31, 27, 0.5, steepness, 51), 1.0},
                     {random_map(20, 20, 1.0, steepness, 52), 3.0},
                     {random_map(9, 33, 0.5, steepness, 53), 0.25},
                     {random_map(60, 60, 0.3, steepness, 54), 1.0}};
  cases.add("PartOfTheCircleAndAFixedX").lattices = {{.x_mm = {2.5, 2.5, 1},
                                                      .y_mm = {-7.0, 4.0, 21},
                                                      .theta_rad = {-0.4, 1.1, 13},
                                                      .pivot_mm = {3.0, -2.0}}};
}

/// A step in cells along x and y, and the path that a CPU must choose for it, so that the cases
/// reach every kernel and tile. A GPU takes few bins of small lattices together.
void add_paths(Cases& cases) {
  constexpr std::pair<glm::dvec2, const char*> paths[] = {
      {{0.2, 0.2}, "5 x 5 bins over one cell"},
      {{0.25, 0.25}, "5 x 5 bins over one cell"},
      {{0.01, 0.07}, "5 x 5 bins over one cell"},
      {{1.0 / 3.0, 0.3}, "4 x 4 bins over one cell"},
      {{0.2, 1.0}, "5 x 2 bins over one cell"},
      {{0.4, 0.4}, "5 x 5 bins over two cells"},
      {{0.5, 0.5}, "5 x 5 bins over two cells"},
      {{0.6, 2.0 / 3.0}, "4 x 4 bins over two cells"},
      {{0.51, 0.99}, "4 x 3 bins over two cells"},
      {{2.0, 0.25}, "2 x 5 bins over two cells"},
      {{1.0, 1.0}, "runs of"},
      {{0.2, 3.0}, "runs of"},
      {{1.0, 1.3}, "runs of"},
      {{1.6, 1.6}, "runs of"},
      {{9.7, 0.9}, "runs of"}};
  for (const auto& [step, path] : paths) {
    LikelihoodCase& of = cases.add(fmt::format("Steps{:.2f}By{:.2f}Cells", step.x, step.y));
    of.path = path;
    of.lower = [](gpu::Limits& limits) { limits.cpu = true; };
    of.lattices = {};
    for (const int n : {7, 23}) {
      of.lattices.push_back({.x_mm = {-2.13, -2.13 + 0.5 * step.x * n, n},
                             .y_mm = {1.37, 1.37 + 0.5 * step.y * n, n},
                             .theta_rad = {0.1, 0.1 + two_pi, 2}});
    }
  }
}

void add_hard_inputs(Cases& cases) {
  // No floor, one too small for products, and the least that products take.
  for (const auto& [gamma, prior] :
       {std::pair(0.0, 0.01), {1e-40, 0.8}, {1e-9, 0.01}, {1e-6, 0.8}, {5e-3, 0.01}, {0.9, 0.8}}) {
    LikelihoodCase& of = cases.add(fmt::format("Gamma{:.0e}Prior{:.0e}", gamma, prior));
    of.options.contact.gamma = gamma;
    of.options.contact.prior = prior;
    of.lattices = lattices_of({0.1, 0.3, 0.8}, 11, 9, 2);
  }
  LikelihoodCase& prior = cases.add("ThePriorOfTheMaps");
  prior.objects = two_objects(steepness, 103);
  for (Hypothesis& object : prior.objects) {
    object.map.prior = 0.35;
  }
  cases.add("AnArrayThatChangesAndHasDeadElements").recording = changing_array();
  // The map spans 15.5 x 13.5 mm about the origin; elements reach 14 mm from it.
  for (const double away_mm : {6.0, 18.0, 400.0, 1e4, 1e9, 1e30}) {
    LikelihoodCase& of = cases.add(fmt::format("Touches{:.0e}MillimetresAway", away_mm));
    of.recording = moved(of.recording, {{away_mm, -away_mm}, 0.0});
  }
  cases.add("FlatMaps").objects = {{random_map(31, 27, 0.5, 0.0, 48), 1.0}};
  // Interpolation in float32 between -130 and 130 errs by 3e-5 nats, but only the few elements that
  // lie where the likelihood is steep feel it.
  cases.add("SteepMaps").objects = {{random_map(31, 27, 0.5, 130.0, 73), 1.0}};
  // Without a floor a touch on a steep map costs thousands of nats, of which float32 interpolation
  // keeps seven digits.
  LikelihoodCase& steep = cases.add("SteepMapsWithoutAFloor");
  steep.objects = {{random_map(31, 27, 0.5, 130.0, 75), 1.0}};
  steep.options.contact.gamma = 0.0;
  steep.share = 3e-7;
  // In Contact where nothing is costs 1,000 nats, of which float32's last digit is 6e-5; No Contact
  // is certain.
  LikelihoodCase& impossible = cases.add("AnImpossibleElement");
  impossible.objects = {{random_map(40, 40, 0.5, 0.0, 77), 1.0}};
  impossible.objects[0].map.log_odds.assign(40 * 40, -1000.0F);
  impossible.recording.elements_mm = {{0.0, 0.0}, {1.0, 1.0}};
  impossible.recording.T_robot_sensor = {Pose{}};
  impossible.recording.pressure = {10.0, 0.0};
  impossible.options.contact.gamma = 0.0;
  impossible.nats = 2e-4;
  // All elements summed in one float32 would be off by 4e-2 nats after 50 touches.
  LikelihoodCase& touches = cases.add("FiftyTouches");
  touches.recording = random_recording(50, 36, 72);
  touches.nats = 2e-5;
  // lavapipe ends a kernel's loops after 65,535 iterations; one theta leaves room for more elements
  // than that in a table.
  LikelihoodCase& many = cases.add("MoreElementsThanALoopMayCount");
  many.recording = random_recording(60, 1400, 76);
  many.nats *= 1400 / 36.0;
  many.lattices = lattices_of({0.1, 1.6}, 4, 1, 1);
}

void add_tables(Cases& cases) {
  const std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, steepness, 72), 1.0},
                                        {random_map(61, 61, 0.25, steepness, 73), 2.0},
                                        {random_map(23, 29, 0.5, steepness, 74), 1.0}};
  const auto add = [&](const char* name, LearnedScene scene) -> LikelihoodCase& {
    LikelihoodCase& of = cases.add(name);
    of.recording = random_recording(3, 36, 76);
    of.lattices = lattices_of({0.1, 0.25, 0.8}, 11, 9, 4);
    of.objects = std::move(scene.objects);
    of.options.contact = std::move(scene.contact);
    return of;
  };
  add("TableOfEveryObject", {objects, random_table(3)});
  LikelihoodCase& none = add("TableOfEveryObjectAndNoneOfThese", {objects, random_table(3)});
  none.options.none_weight = 2.0;
  none.nats = per_mean;
  add("TableOfAllObjects", {objects, random_table(1)});
  add("LearnedLayerOfLogOdds", learned_scene(MapLayer::log_odds, 301));
  add("LearnedLayerOfMeanLevels", learned_scene(MapLayer::mean_level, 301));
  // 8 levels make up to 8 segments of one element or two in every touch: loops over segments end,
  // too.
  LikelihoodCase& segments = add("TableOfManyShortSegments", {{objects[0]}, random_table(1)});
  segments.recording = random_recording(2500, 8, 77);
  segments.lattices = lattices_of({0.1, 0.8}, 3, 3, 2);
  LikelihoodCase& storage = add("TableBesideAMapInStorage", {objects, random_table(3)});
  storage.objects[1].map = random_map(160, 170, 0.1, steepness, 77);
  // Above the table's 3 sets of 10 rows of 521 nodes, and below the map's cells.
  storage.lower = [](gpu::Limits& limits) { limits.table_texels = 22'000; };
}

/// Cells of a map as kernels read it.
constexpr std::uint32_t bordered(int nx, int ny) {
  return static_cast<std::uint32_t>((nx + 2 * shaders::MAP_BORDER) *
                                    (ny + 2 * shaders::MAP_BORDER));
}

void add_devices(Cases& cases) {
  for (const MadeUpDevice& device : made_up_devices) {
    LikelihoodCase& of = cases.add(fmt::format("Device{}", device.name));
    of.objects = two_objects(steepness, 141);
    of.objects[1].weight = 2.0;
    of.lower = [device](gpu::Limits& limits) { limits = device.limits(limits); };
    // More than one chunk of thetas; pairs of bins within a row and across rows.
    of.lattices = {lattices_of({0.1}, 19, 17, 33).front(), lattices_of({0.8}, 20, 17, 33).front()};
  }
  LikelihoodCase& large = cases.add("AMapThatNoTableHoldsBesideASmallOne");
  large.objects = {{random_map(40, 40, 0.5, steepness, 149), 1.0},
                   {random_map(9, 11, 0.5, steepness, 150), 1.0}};
  large.paths = 2;
  large.lower = [](gpu::Limits& limits) { limits.table_texels = bordered(40, 40) - 1; };
  LikelihoodCase& tables = cases.add("MapsInSeveralTables");
  tables.objects = {};
  for (std::uint64_t i = 0; i < 5; ++i) {
    tables.objects.push_back({random_map(11, 12, i == 2 ? 0.3 : 0.5, steepness, 152 + i), 1.0});
  }
  tables.paths = 2;  // of two sizes of cells
  tables.lower = [](gpu::Limits& limits) { limits.table_texels = 2 * bordered(11, 12); };
}

/// The belief of two objects is cut into several parts: 1,560 bins in a plane, 7 planes.
void add_slabs(Cases& cases) {
  constexpr VkDeviceSize plane_bytes = std::size_t{40} * 39 * 2 * sizeof(float);
  const auto add = [&](const char* name, int nx, std::function<void(gpu::Limits&)> lower) {
    LikelihoodCase& of = cases.add(name);
    of.objects = {{random_map(20, 20, 0.5, 4.0, 111), 1.0},
                  {random_map(18, 21, 0.5, 4.0, 112), 2.0}};
    of.recording = random_recording(2, 12, 113);
    of.lattices = {
        {.x_mm = {-5.0, 5.0, nx}, .y_mm = {-5.0, 5.0, 39}, .theta_rad = {0.0, two_pi, 7}}};
    of.lower = std::move(lower);
  };
  const auto bound = [](VkDeviceSize bytes) {
    return [bytes](gpu::Limits& limits) { limits.storage_range = bytes; };
  };
  add("SlabsOfSeveralPlanes", 40, bound(3 * plane_bytes + 8));
  // An odd number of bins: the second object's begin after a gap.
  add("SlabsOfOneObjectOrSeveral", 41, bound(std::size_t{41} * 39 * 7 * 2 * sizeof(float) * 3 / 2));
  add("SlabsOfOnePlane", 40, bound(plane_bytes));
  add("SlabsOfPartsOfAPlane", 40, bound(plane_bytes / 2 + 8));
  // 10 workgroups of 64 bins cover less than half a plane.
  add("SlabsByTheWorkgroupsAlongX", 40, [](gpu::Limits& limits) { limits.group_count[0] = 10; });
  add("SlabsByTheWorkgroupsAlongZ", 40, [](gpu::Limits& limits) { limits.group_count[2] = 2; });
  // 65 workgroups cover each of these planes, but 67 would be needed to reduce all 65 of them.
  add("SlabsByTheWorkgroupsOfAReduction", 64,
      [](gpu::Limits& limits) { limits.group_count[0] = 65; });
  cases.all.back().recording = random_recording(1, 4, 114);
  cases.all.back().lattices.front().y_mm.count = 65;
  cases.all.back().lattices.front().theta_rad.count = 65;
}

}  // namespace

std::vector<PoseLattice> lattices_of(std::initializer_list<double> steps_mm, int nx, int ny,
                                     int thetas) {
  std::vector<PoseLattice> lattices;
  for (const double step : steps_mm) {
    lattices.push_back({.x_mm = {-2.13, -2.13 + step * nx, nx},
                        .y_mm = {-3.37, -3.37 + step * ny, ny},
                        .theta_rad = {0.1, 0.1 + two_pi, thetas}});
  }
  return lattices;
}

Recording changing_array() {
  Recording recording = random_recording(5, 36, 58);
  Uniform random(59);
  recording.elements_mm.clear();
  for (double& pressure : recording.pressure) {
    recording.elements_mm.emplace_back(random(-6.0, 6.0), random(-6.0, 6.0));
    recording.valid.push_back(random(0.0, 1.0) < 0.8 ? 1 : 0);
    pressure = recording.valid.back() == 0 ? 1e6 : pressure;
  }
  return recording;
}

std::vector<LikelihoodCase> histogram_cases() {
  Cases cases;
  add_sizes(cases);
  add_paths(cases);
  add_hard_inputs(cases);
  add_tables(cases);
  add_devices(cases);
  add_slabs(cases);
  for (LikelihoodCase& displaced : displaced_cases()) {
    cases.all.push_back(std::move(displaced));
  }
  return std::move(cases.all);
}

}  // namespace palpate
