#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/map_likelihood.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/touch.hpp"
#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::contact_test {

constexpr Reading in = Reading::in_contact;
constexpr Reading no = Reading::no_contact;
constexpr Reading unknown = Reading::unknown;
using Readings = std::vector<Reading>;

/// The readings, which must be the reference's.
Readings classify(const std::vector<double>& pressure, const std::vector<std::uint8_t>& valid = {},
                  const ContactClassifier& classifier = {}) {
  const std::vector<glm::dvec2> elements(pressure.size());
  const Touch touch{.elements_mm = elements, .pressure = pressure, .valid = valid};
  const Readings readings = classifier.classify(touch);
  EXPECT_EQ(readings, reference::classify(touch, classifier));
  return readings;
}

TEST(ContactClassifier, NeedsBothTestsToAgree) {
  // Threshold 2, ratio 0.3, largest 20: the second bound is 6.
  EXPECT_EQ(classify({20.0, 7.0, 5.0, 1.0}), (Readings{in, in, unknown, no}));
  // Largest 4: the second bound is 1.2.
  EXPECT_EQ(classify({4.0, 2.5, 1.5, 1.0}), (Readings{in, in, unknown, no}));
  EXPECT_EQ(classify({1.0, 1.0}), (Readings{unknown, unknown})) << "equal, below the threshold";
  EXPECT_EQ(classify({0.0, 0.0}), (Readings{unknown, unknown})) << "none is below 0.3 times 0";
  EXPECT_TRUE(classify({}).empty());
}

TEST(ContactClassifier, EqualityIsUnknown) {
  const ContactClassifier half{.threshold = 2.0, .ratio = 0.5};
  EXPECT_EQ(classify({8.0, 2.0}, {}, half), (Readings{in, unknown})) << "threshold";
  EXPECT_EQ(classify({8.0, 4.0}, {}, half), (Readings{in, unknown})) << "ratio, above the other";
  EXPECT_EQ(classify({3.0, 1.5}, {}, half), (Readings{in, unknown})) << "ratio, below the other";
}

TEST(ContactClassifier, DeadElementsAndNonNumbersAreUnknownAndDoNotSetTheMaximum) {
  EXPECT_EQ(classify({1e9, 5.0, 1.0}, {0, 1, 1}), (Readings{unknown, in, no}));
  EXPECT_EQ(classify({nan, 5.0, 1.0}, {0, 1, 1}), (Readings{unknown, in, no}));
  EXPECT_EQ(classify({5.0, 1.0}, {0, 0}), (Readings{unknown, unknown}));
  EXPECT_EQ(classify({nan, 5.0, 1.0}), (Readings{unknown, in, no}));
  EXPECT_EQ(classify({5.0, nan, 1.0}), (Readings{in, unknown, no}));
}

TEST(ContactClassifier, RefusesBoundsThatDecideNothing) {
  const auto expect_refused = [](const ContactClassifier& classifier, const char* field) {
    expect_named(input_error([&] { classifier.validate(); }), {field});
    const std::vector<glm::dvec2> elements(2);
    const std::vector<double> pressure{5.0, 1.0};
    const Touch touch{.elements_mm = elements, .pressure = pressure};
    expect_named(input_error([&] { classifier.classify(touch); }), {field});
  };
  for (const double threshold : {nan, infinity, -infinity, -0.1}) {
    expect_refused({.threshold = threshold}, "threshold = ");
  }
  for (const double ratio : {nan, infinity, -0.1, 1.0, 1.5}) {
    expect_refused({.ratio = ratio}, "ratio = ");
  }
  ContactClassifier{.threshold = 0.0, .ratio = 0.0}.validate();
}

TEST(FaultOfReadings, IsAPlaceBeyondWhatAMapMayReach) {
  const ElementReading near{{1e9, -1e9}, in};
  EXPECT_EQ(fault_of(std::vector{near}), std::nullopt);
  for (const double far : {1.1e9, -1e300, infinity, nan}) {
    for (const glm::dvec2 at : {glm::dvec2(far, 0.0), glm::dvec2(0.0, far)}) {
      EXPECT_NE(fault_of(std::vector<ElementReading>{near, {at, no}}), std::nullopt) << far;
    }
  }
}

/// The model's log-likelihood, which must be the reference's.
double log_likelihood(const ContactModel& model, Reading reading, double log_odds,
                      std::size_t object = 0) {
  const double nats = model.log_likelihood(reading, {log_odds}, object);
  EXPECT_NEAR(nats, reference::log_likelihood(reading, {log_odds}, model, object), 1e-12)
      << "float64 rounding of logs below 30";
  return nats;
}

TEST(ContactModel, IsEquation7) {
  for (const double gamma : {0.0, 1e-6, 0.1, 0.5, 0.99}) {
    for (const double prior : {0.02, 0.2, 0.7}) {
      for (const Reading reading : {in, no, unknown}) {
        const ContactModel model{.gamma = gamma, .prior = prior};
        for (double l = -30.0; l <= 30.0; l += 0.7) {
          log_likelihood(model, reading, l);
        }
        log_likelihood(model, reading, -1000.0);
        log_likelihood(model, reading, 1000.0);
      }
    }
  }
}

TEST(ContactModel, RefusesWhatIsOutOfRange) {
  ContactModel().validate();
  ContactModel{.gamma = 0.0}.validate();
  for (const double gamma : {-0.1, 1.0, 2.0, nan}) {
    expect_named(input_error([&] { ContactModel{.gamma = gamma}.validate(); }), {"gamma = "});
  }
  for (const double prior : {0.0, 1.0, -1.0, nan}) {
    expect_named(input_error([&] { ContactModel{.prior = prior}.validate(); }), {"prior = "});
  }
}

/// Two objects, three levels, three nodes.
LikelihoodTable small_table() {
  return {.first_log_odds = -2.0,
          .last_log_odds = 2.0,
          .nodes = 3,
          .level_edges = {10.0},
          .log_likelihood = {-1.0, -2.0, -4.0, -5.0, -3.0, -1.0, -9.0, -8.0, -7.0,  //
                             -0.1, -0.2, -0.3, -0.4, -0.5, -0.6, -0.7, -0.8, -0.9}};
}

TEST(LikelihoodTable, IsLinearBetweenItsNodesAndConstantBeyond) {
  ContactModel model{.table = small_table()};
  struct Row {
    Reading reading;
    double log_odds;
    std::size_t object;
    double nats;
  };
  for (const auto& [reading, log_odds, object, nats] :
       {Row{no, -2.0, 0, -1.0}, Row{no, 0.0, 0, -2.0}, Row{no, 1.0, 0, -3.0}, Row{no, 2.0, 0, -4.0},
        Row{no, -100.0, 0, -1.0}, Row{no, 100.0, 0, -4.0}, Row{in, -1.0, 0, -4.0},
        Row{contact_level(1), 1.5, 0, -7.25}, Row{in, 1.0, 1, -0.55}, Row{unknown, 1.0, 1, 0.0}}) {
    EXPECT_DOUBLE_EQ(log_likelihood(model, reading, log_odds, object), nats);
  }
  model.table->log_likelihood.resize(9);
  for (const std::size_t object : {0U, 1U, 7U}) {
    EXPECT_EQ(log_likelihood(model, no, 1.0, object), -3.0) << "one set for all objects";
  }
}

TEST(LikelihoodTable, DividesContactByItsEdges) {
  ContactModel model{.table = small_table()};
  model.table->level_edges = {7.0, 10.0, 15.0};
  const std::vector<double> pressure{20.0, 1.0, 6.5, 7.0, 9.99, 10.0, 15.0, 3.0, nan, 40.0};
  const std::vector<std::uint8_t> valid{1, 1, 1, 1, 1, 1, 1, 1, 1, 0};
  const std::vector<glm::dvec2> elements(pressure.size());
  const Touch touch{.elements_mm = elements, .pressure = pressure, .valid = valid};
  // Eq. 3 asks for more than 2 and 6; 3.0 is between them.
  const std::vector<Reading> expected{
      contact_level(3), no,      in,      contact_level(1), contact_level(1), contact_level(2),
      contact_level(3), unknown, unknown, unknown};
  EXPECT_EQ(model.classify(touch), expected);
  EXPECT_EQ(reference::classify(touch, model), expected);
  model.table.reset();
  EXPECT_EQ(model.classify(touch), model.classifier.classify(touch)) << "Eq. 7 knows one level";
}

TEST(LikelihoodTable, RefusesOneThatIsNotSound) {
  using Table = LikelihoodTable;
  /// A table that is changed in one respect, and what is said of it.
  const auto expect_refused = [](const auto& change, const char* says) {
    ContactModel model{.table = small_table()};
    model.validate();
    change(*model.table);
    expect_named(input_error([&] { model.validate(); }), {"likelihood table: ", says});
  };
  for (const std::size_t nodes : {0U, 1U}) {
    expect_refused([&](Table& t) { t.nodes = nodes; }, "nodes = ");
    input_error([&] { ContactModel{.table = Table{.nodes = nodes}}.log_likelihood({}, {}); });
  }
  for (const double end : {nan, infinity, -2.0, -3.0, -1.999, 1001.0}) {
    expect_refused([&](Table& t) { t.last_log_odds = end; }, "3 nodes from log odds -2 to");
  }
  expect_refused([](Table& t) { t.first_log_odds = nan; }, "3 nodes from log odds nan to");
  for (const double edge : {nan, infinity}) {
    expect_refused([&](Table& t) { t.level_edges = {edge}; }, "level_edges[0] = ");
  }
  expect_refused([](Table& t) { t.level_edges = {5.0, 3.0}; }, "level_edges[1] = 3");
  expect_refused([](Table& t) { t.level_edges = {1, 2, 3, 4, 5, 6, 7}; }, "9 levels");
  ContactModel most{.table = small_table()};
  most.table->level_edges = {1, 2, 3, 4, 5, 6};
  most.table->log_likelihood.assign(8 * 3, -1.0);
  most.validate();
  expect_refused([](Table& t) { t.log_likelihood.clear(); }, "0 numbers");
  expect_refused([](Table& t) { t.log_likelihood.pop_back(); }, "17 numbers");
  for (const double nats : {nan, infinity, -infinity, -2e30}) {
    expect_refused([&](Table& t) { t.log_likelihood[13] = nats; }, "log_likelihood[1, 1, 1] = ");
  }
}

TEST(MapLikelihood, OfAllReadingsIsTheContactModels) {
  const Pose T_object_sensor{{1.0, -2.0}, 0.4};
  const std::vector<glm::dvec2> elements_mm = digitacts_array();
  for (const double steepness : {0.0, 1.0, 30.0, 1000.0}) {
    const OccupancyGrid map = random_map(33, 21, 0.5, steepness, 3);
    for (const double gamma : {0.0, 1e-9, 0.1, 0.9}) {
      const ContactModel model{.gamma = gamma, .prior = 0.2};
      const MapLikelihood likelihood(map, model);
      std::vector<double> logs(2 * elements_mm.size());
      likelihood.all_readings(elements_mm, T_object_sensor, logs);
      for (std::size_t i = 0; i < logs.size(); ++i) {
        const double log_odds = likelihood.log_odds(T_object_sensor * elements_mm[i / 2]);
        const double expected = model.log_likelihood(static_cast<Reading>(i % 2), {log_odds});
        // Two ways of rounding: places by 1e-15 mm, at slopes of up to 4,000 nats/mm.
        EXPECT_NEAR(logs[i], expected, 1e-10 * std::max(1.0, std::abs(expected)));
      }
    }
  }
}

TEST(MapLikelihood, RefusesReadingsThatItsTableDoesNotHave) {
  LikelihoodTable table{.nodes = 17, .level_edges = {8.0}, .log_likelihood = {}};
  table.log_likelihood.assign(2 * 3 * 17, -1.0);
  const ContactModel model{.prior = 0.2, .table = table};
  const OccupancyGrid map = random_map(9, 9, 1.0, 1.0, 4);
  TouchEvidence touch;
  touch.elements_mm.resize(2);
  touch.readings = {contact_level(1), Reading::unknown};
  const MapLikelihood likelihood(map, model, 1);
  EXPECT_EQ(likelihood.at(touch, Pose{}), -1.0);
  touch.readings[1] = contact_level(2);
  const std::string message = input_error([&] { likelihood.at(touch, Pose{}); });
  expect_named(message, {"3 levels", "2 sets", "none for level 3 of object 1"});
  EXPECT_EQ(message, input_error([&] { model.log_likelihood(touch.readings[1], {}, 1); }));
  EXPECT_EQ(MapLikelihood(map, {.prior = 0.2}).at(touch, Pose{}),
            2.0 * MapLikelihood(map, {.prior = 0.2}).at(Reading::in_contact, {}))
      << "Eq. 7 has one level";
}

/// Largest difference in nats of predictive() from the normalised log-likelihoods, over random
/// poses.
double largest_error(const ContactModel& contact) {
  const std::vector<OccupancyGrid> maps{random_map(31, 27, 0.5, 6.0, 81),
                                        random_map(14, 15, 1.0, 6.0, 83)};
  const ContactModel model = predictive(contact);
  const std::vector<glm::dvec2> elements = digitacts_array();
  Uniform uniform(11);
  double largest = 0.0;
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t object = static_cast<std::size_t>(trial) % maps.size();
    // Some elements lie beyond the maps, and some of these far beyond.
    const double reach = trial % 10 == 9 ? 1e8 : 12.0;
    const Pose T_object_sensor{{uniform(-reach, reach), uniform(-reach, reach)}, uniform(-4, 4)};
    const MapLikelihood likelihood(maps[object], contact, object);
    const std::size_t levels = likelihood.levels();
    std::vector<double> logs(elements.size() * levels);
    MapLikelihood(maps[object], model, object).all_readings(elements, T_object_sensor, logs);
    std::vector<double> expected(logs.size());
    likelihood.all_readings(elements, T_object_sensor, expected);
    for (std::size_t e = 0; e < elements.size(); ++e) {
      double sum = 0.0;
      for (std::size_t level = 0; level < levels; ++level) {
        sum += std::exp(expected[e * levels + level]);
      }
      for (std::size_t i = e * levels; i < (e + 1) * levels; ++i) {
        largest = std::max(largest, std::abs(logs[i] - expected[i] + std::log(sum)));
      }
    }
  }
  return largest;
}

TEST(Predictive, AgreesWithTheContactModel) {
  for (const double gamma : {0.0, 0.1, 0.9}) {
    EXPECT_LT(largest_error({.gamma = gamma, .prior = 0.2}), 2e-4) << gamma;
  }
}

TEST(Predictive, KnowsTheLevelsOfATableAndItsObjects) {
  // Nodes one nat apart are nodes of the predictive table too.
  LikelihoodTable table{.first_log_odds = -8.0,
                        .last_log_odds = 8.0,
                        .nodes = 17,
                        .level_edges = {3.0, 5.0},
                        .log_likelihood = {}};
  Uniform uniform(12);
  for (int i = 0; i < 2 * 4 * 17; ++i) {
    table.log_likelihood.push_back(uniform(-4.0, 0.0));
  }
  // Levels' slopes differ by up to 8, so the curvature of their log-sum is at most 16: times the
  // square of a step of 1/32 nats, over 8.
  EXPECT_LT(largest_error({.prior = 0.2, .table = table}), 2e-3);
}

}  // namespace palpate::contact_test
