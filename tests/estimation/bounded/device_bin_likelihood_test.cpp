#include "estimation/bounded/device_bin_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bins_by_definition.hpp"
#include "estimation/bounded/bound_search.hpp"
#include "estimation/bounded/device_bin_error.hpp"
#include "estimation/bounded/faster_bin_likelihood.hpp"
#include "estimation/contact_evidence.hpp"
#include "made_up_devices.hpp"
#include "synthetic.hpp"

namespace palpate::device_bin_likelihood_test {

std::size_t bins_of(const std::vector<BinBox>& boxes) {
  std::size_t bins = 0;
  for (const BinBox& box : boxes) {
    bins += static_cast<std::size_t>(box.bins());
  }
  return bins;
}

/// Boxes of up to 7 x 7 bins, anywhere, in any order.
std::vector<BinBox> random_boxes(std::size_t count, const PoseLattice& lattice, std::size_t objects,
                                 std::uint64_t seed) {
  Uniform random(seed);
  const auto below = [&](int end) {
    return std::min(end - 1, static_cast<int>(random(0.0, static_cast<double>(end))));
  };
  std::vector<BinBox> boxes;
  for (std::size_t i = 0; i < count; ++i) {
    BinBox box{.object = below(static_cast<int>(objects)),
               .theta = below(lattice.theta_rad.count),
               .y_first = below(lattice.y_mm.count),
               .x_first = below(lattice.x_mm.count)};
    box.y_count = 1 + below(std::min(7, lattice.y_mm.count - box.y_first));
    box.x_count = 1 + below(std::min(7, lattice.x_mm.count - box.x_first));
    boxes.push_back(box);
  }
  return boxes;
}

/// A case of one map or several; that of `of` is not read.
struct MapsCase {
  BinCase of;
  std::vector<Hypothesis> hypotheses;

  explicit MapsCase(const BinCase& one) : of(one), hypotheses{{one.map, 1.0}} {}
};

/// The device's bins are finite and, by the host's float64, within the bound.
void expect_within_bound(gpu::Context& context, const MapsCase& maps,
                         const std::vector<BinBox>& boxes, const std::string& name) {
  const auto& [of, hypotheses] = maps;
  const BinLikelihood host(hypotheses, of.contact, of.lattice);
  DeviceBinLikelihood device(context, hypotheses, of.contact, of.lattice);
  const DeviceBinError bound(hypotheses, of.contact, of.lattice);
  std::vector<double> expected(bins_of(boxes));
  std::vector<float> got(expected.size(), -7.0F);
  host.evaluate(boxes, of.elements, std::span(expected));
  device.evaluate(boxes, of.elements, got);
  std::size_t bin = 0;
  for (const BinBox& box : boxes) {
    const auto object = static_cast<std::size_t>(box.object);
    const double most = bound.nats(object, of.elements) + host.float64_error(object, of.elements);
    for (std::int64_t i = 0; i < box.bins(); ++i, ++bin) {
      ASSERT_LE(std::abs(got[bin] - expected[bin]), most)
          << name << ": bin " << i << " of a box of object " << object << ", theta " << box.theta;
    }
  }
}

MapsCase four_maps() {
  MapsCase maps(letter_case());
  maps.hypotheses = {{random_map(31, 27, 0.5, 12.0, 91), 1.0},
                     {random_map(20, 40, 1.0, 5.0, 92), 1.0},
                     {random_map(9, 11, 0.5, 12.0, 93), 1.0},
                     {random_map(200, 3, 0.1, 3.0, 94), 1.0}};
  return maps;
}

class Boxes : public testing::TestWithParam<std::size_t> {};

TEST_P(Boxes, AreWithinTheBoundOnTheDevice) {
  Device device = Device::open();
  const MapsCase maps = four_maps();
  expect_within_bound(device.context(), maps,
                      random_boxes(GetParam(), maps.of.lattice, 4, GetParam()), "boxes");
}

INSTANTIATE_TEST_SUITE_P(Numbers, Boxes, testing::Values(0, 1, 7, 63, 65, 1000));

class ElementsOnTheDevice : public testing::TestWithParam<std::size_t> {};

TEST_P(ElementsOnTheDevice, AreWithinTheBound) {
  Device device = Device::open();
  MapsCase maps(letter_case());
  maps.of.elements = random_elements(GetParam(), 6.0, 2, GetParam());
  expect_within_bound(device.context(), maps, random_boxes(20, maps.of.lattice, 1, 95), "elements");
}

// The last are more than a dispatch takes.
INSTANTIATE_TEST_SUITE_P(Numbers, ElementsOnTheDevice,
                         testing::Values(0, 1, 7, 63, 65, 1000, 20000));

TEST(DeviceBinLikelihood, StaysWithinItsBoundInHardCases) {
  Device device = Device::open();
  const auto check = [&](const std::string& name, const auto& change) {
    BinCase of = letter_case();
    change(of);
    expect_within_bound(device.context(), MapsCase(of), random_boxes(30, of.lattice, 1, 96), name);
  };
  for (const double gamma : {0.0, 1e-300, 1e-9, 1e-6, 0.1, 0.9}) {
    for (const double steepness : {2.0, 1000.0}) {
      check(fmt::format("gamma {}, log odds +-{}", gamma, steepness), [&](BinCase& of) {
        of.contact.gamma = gamma;
        of.contact.prior = 0.05;
        of.map = random_map(31, 27, 0.5, steepness, 97);
      });
    }
  }
  for (const double cell_mm : {0.02, 100.0}) {
    check(fmt::format("cells of {} mm", cell_mm),
          [&](BinCase& of) { of.map = random_map(41, 37, cell_mm, 12.0, 98); });
  }
  check("a pivot 1e5 mm from the touches", [](BinCase& of) {
    of.map = random_map(41, 37, 0.02, 12.0, 99);
    of.lattice.theta_rad = {-1e-6, 1e-6, 3};
    of.lattice.x_mm = {-1e5 - 3.0, -1e5 + 3.0, 23};
    for (glm::dvec2& p_mm : of.elements.from_pivot_mm) {
      p_mm = glm::dvec2(1e5, 0.0) + 0.1 * p_mm;
    }
  });
  for (const double away_mm : {40.0, 1e6, 1e30}) {
    check(fmt::format("elements {} mm away", away_mm), [&](BinCase& of) {
      for (std::size_t e = 0; e < of.elements.from_pivot_mm.size(); e += 2) {
        of.elements.from_pivot_mm[e] = {away_mm, -0.7 * away_mm};
      }
    });
  }
}

TEST(DeviceBinLikelihood, TakesEachObjectsRowsOfATable) {
  Device device = Device::open();
  MapsCase maps = four_maps();
  LikelihoodTable table{.first_log_odds = -7.0, .last_log_odds = 9.0, .nodes = 13};
  table.level_edges = {5.0};
  Uniform random(100);
  for (std::size_t i = 0; i < 4 * 3 * table.nodes; ++i) {
    table.log_likelihood.push_back(random(-4.0, 0.0));
  }
  maps.of.contact.table = table;
  maps.of.elements = random_elements(41, 6.0, 3, 101);
  expect_within_bound(device.context(), maps, random_boxes(200, maps.of.lattice, 4, 102), "table");
}

TEST(DeviceBinLikelihood, HasAUsefulBoundOnALetter) {
  const MapsCase maps(letter_case());
  const DeviceBinError bound(maps.hypotheses, maps.of.contact, maps.of.lattice);
  EXPECT_LT(bound.nats(0, maps.of.elements), 1e-2);
}

class KindOfDevice : public testing::TestWithParam<MadeUpDevice> {};

TEST_P(KindOfDevice, IsWithinTheBound) {
  Device device = Device::open();
  gpu::Context& context = device.context();
  context.lower_limits(GetParam().limits(context.limits()));
  const MapsCase maps = four_maps();
  expect_within_bound(context, maps, random_boxes(63, maps.of.lattice, 4, 103), GetParam().name);
}

INSTANTIATE_TEST_SUITE_P(Kinds, KindOfDevice, testing::ValuesIn(made_up_devices));

TEST(DeviceBinLikelihood, CutsBoxesForSmallBuffers) {
  Device device = Device::open();
  gpu::Context& context = device.context();
  gpu::Limits limits = context.limits();
  // Places of the lattice, 768 bytes an object; results of 1,024 bins; maps in storage buffers.
  limits.storage_range = 8192;
  limits.table_texels = 64;
  context.lower_limits(limits);
  MapsCase maps(letter_case());
  std::vector<BinBox> boxes{whole_plane(maps.of.lattice, 1), whole_plane(maps.of.lattice, 2)};
  expect_within_bound(context, maps, boxes, "planes");
  // Rows of more bins than a dispatch takes.
  limits.group_count[0] = 1;
  limits.group_invocations = 4;
  context.lower_limits(limits);
  expect_within_bound(context, maps, boxes, "parts of rows");
}

TEST(DeviceBinLikelihood, HasTheSameBitsInEveryBox) {
  Device device = Device::open();
  const MapsCase maps(letter_case());
  DeviceBinLikelihood likelihood(device.context(), maps.hypotheses, maps.of.contact,
                                 maps.of.lattice);
  const BinBox plane = whole_plane(maps.of.lattice, 2);
  std::vector<float> whole(static_cast<std::size_t>(plane.bins()));
  likelihood.evaluate(std::span(&plane, 1), maps.of.elements, whole);
  std::vector<BinBox> boxes = random_boxes(100, maps.of.lattice, 1, 104);
  for (BinBox& box : boxes) {
    box.theta = 2;
  }
  std::vector<float> parts(bins_of(boxes));
  likelihood.evaluate(boxes, maps.of.elements, parts);
  std::size_t bin = 0;
  for (const BinBox& box : boxes) {
    for (int j = 0; j < box.y_count; ++j) {
      for (int i = 0; i < box.x_count; ++i, ++bin) {
        ASSERT_EQ(parts[bin], whole[(box.y_first + j) * plane.x_count + box.x_first + i]);
      }
    }
  }
}

/// The faster likelihood's bins are within its own bound of the host's float64.
void expect_sound(FasterBinLikelihood& faster, const BinLikelihood& host, const MapsCase& maps,
                  const std::vector<BinBox>& boxes) {
  std::vector<double> expected(bins_of(boxes));
  std::vector<float> got(expected.size(), -7.0F);
  host.evaluate(boxes, maps.of.elements, std::span(expected));
  faster.evaluate(boxes, maps.of.elements, got);
  for (std::size_t i = 0; i < got.size(); ++i) {
    ASSERT_LE(std::abs(got[i] - expected[i]),
              faster.float32_error(0, maps.of.elements) + host.float64_error(0, maps.of.elements))
        << faster.path() << ", bin " << i;
  }
}

TEST(FasterBinLikelihood, GoesWhereItIsTold) {
  Device device = Device::open();
  const MapsCase maps(letter_case());
  const BinLikelihood host(maps.hypotheses, maps.of.contact, maps.of.lattice);
  std::vector<BinBox> boxes = random_boxes(300, maps.of.lattice, 1, 105);
  boxes.push_back(whole_plane(maps.of.lattice, 0));
  for (const BinPlace place : {BinPlace::host, BinPlace::device}) {
    FasterBinLikelihood faster(host, &device.context(), maps.hypotheses, maps.of.contact,
                               maps.of.lattice, place);
    EXPECT_NE(faster.path().find(place == BinPlace::host ? "host" : "device"), std::string::npos);
    expect_sound(faster, host, maps, boxes);
  }
  FasterBinLikelihood on_host(host, &device.context(), maps.hypotheses, maps.of.contact,
                              maps.of.lattice, BinPlace::host);
  std::vector<float> plain(bins_of(boxes));
  std::vector<float> in_threads(plain.size());
  host.evaluate(boxes, maps.of.elements, std::span(plain));
  on_host.evaluate(boxes, maps.of.elements, in_threads);
  EXPECT_EQ(in_threads, plain);
}

TEST(FasterBinLikelihood, MeasuresOnceTheHostHasDoneEnough) {
  Device device = Device::open();
  gpu::Context& context = device.context();
  gpu::Limits limits = context.limits();
  const MapsCase maps(letter_case());
  const BinLikelihood host(maps.hypotheses, maps.of.contact, maps.of.lattice);
  const std::vector<BinBox> small = random_boxes(1, maps.of.lattice, 1, 106);
  const std::vector<BinBox> large{whole_plane(maps.of.lattice, 0)};

  limits.cpu = true;
  context.lower_limits(limits);
  FasterBinLikelihood beside_a_cpu(host, &context, maps.hypotheses, maps.of.contact,
                                   maps.of.lattice, BinPlace::measured, 1e4);
  expect_sound(beside_a_cpu, host, maps, large);
  EXPECT_NE(beside_a_cpu.path().find("is a CPU"), std::string::npos);

  limits.cpu = false;
  context.lower_limits(limits);
  FasterBinLikelihood faster(host, &context, maps.hypotheses, maps.of.contact, maps.of.lattice,
                             BinPlace::measured, 7e4);
  expect_sound(faster, host, maps, small);
  EXPECT_NE(faster.path().find("too few so far"), std::string::npos);
  std::vector<float> hurried(bins_of(large));
  faster.evaluate(large, maps.of.elements, hurried, false);
  EXPECT_NE(faster.path().find("too few so far"), std::string::npos);
  expect_sound(faster, host, maps, large);
  // Either may be faster; the rates of both are said, and decide.
  EXPECT_NE(faster.path().find("per element and bin"), std::string::npos) << faster.path();
  const std::string decided = faster.path();
  expect_sound(faster, host, maps, large);
  EXPECT_EQ(faster.path(), decided);
}

TEST(FasterBinLikelihood, IsNotMeasuredWithinABudget) {
  Device device = Device::open();
  gpu::Context& context = device.context();
  gpu::Limits limits = context.limits();
  limits.cpu = false;
  context.lower_limits(limits);
  const MapsCase maps(letter_case());
  const BinLikelihood host(maps.hypotheses, maps.of.contact, maps.of.lattice);
  const BoundedOptions options{.lattice = maps.of.lattice, .contact = maps.of.contact};
  for (const std::optional<double> budget_s : {std::optional<double>(), std::optional(1e3)}) {
    FasterBinLikelihood faster(host, &context, maps.hypotheses, maps.of.contact, maps.of.lattice,
                               BinPlace::measured, 1.0);
    SearchSpace space(maps.hypotheses, options);
    BoundSearch search(space, options, host, faster);
    const ArrayReadings touch = readings_of(maps.of.elements);
    search.add(std::span(&touch, 1));
    search.run(maps.of.elements, {.tolerance = 1e-6}, Deadline(budget_s),
               [](const BinBox& /*box*/, std::span<const double> /*values*/) {});
    EXPECT_EQ(faster.path().find("too few so far") != std::string::npos, budget_s.has_value())
        << faster.path();
  }
}

TEST(FasterBinLikelihood, StaysOnTheHostWhereTheDeviceFails) {
  Device device = Device::open();
  gpu::Context& context = device.context();
  const MapsCase maps(letter_case());
  const BinLikelihood host(maps.hypotheses, maps.of.contact, maps.of.lattice);
  gpu::Limits limits = context.limits();
  limits.cpu = false;
  // No map fits.
  limits.storage_range = 1024;
  limits.table_texels = 16;
  context.lower_limits(limits);
  FasterBinLikelihood faster(host, &context, maps.hypotheses, maps.of.contact, maps.of.lattice,
                             BinPlace::measured, 1.0);
  expect_sound(faster, host, maps, {whole_plane(maps.of.lattice, 0)});
  EXPECT_NE(faster.path().find("bins on the host: map"), std::string::npos) << faster.path();
}

}  // namespace palpate::device_bin_likelihood_test
