#include "palpate/contact_model.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::contact_model_test {

constexpr Reading in = Reading::in_contact;
constexpr Reading no = Reading::no_contact;

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
      for (double l = -30.0; l <= 30.0; l += 0.7) {
        for (const Reading reading : {in, no, Reading::unknown}) {
          log_likelihood({.gamma = gamma, .prior = prior}, reading, l);
        }
      }
    }
  }
}

TEST(ContactModel, HasAFloorWithGammaAlone) {
  const ContactModel without{.gamma = 0.0, .prior = 0.2};
  EXPECT_EQ(without.log_likelihood(in, {-1000.0}), -1000.0);
  EXPECT_EQ(without.log_likelihood(in, {1000.0}), 0.0);
  EXPECT_EQ(without.log_likelihood(no, {1000.0}), -1000.0);
  EXPECT_EQ(without.log_likelihood(no, {-1000.0}), 0.0);
  const ContactModel with{.gamma = 0.1, .prior = 0.2};
  EXPECT_NEAR(with.log_likelihood(in, {-1000.0}), std::log(0.02), 1e-15);
  EXPECT_NEAR(with.log_likelihood(no, {1000.0}), std::log(0.02), 1e-15);
  EXPECT_NEAR(with.log_likelihood(in, {1000.0}), std::log(0.92), 1e-15);
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
        Row{contact_level(1), 1.5, 0, -7.25}, Row{in, 1.0, 1, -0.55},
        Row{Reading::unknown, 1.0, 1, 0.0}}) {
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
  constexpr Reading unknown = Reading::unknown;
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
  }
  for (const double end : {nan, infinity, -2.0, -3.0, -1.999, 1001.0}) {
    expect_refused([&](Table& t) { t.last_log_odds = end; }, "3 nodes from log odds -2 to");
  }
  expect_refused([](Table& t) { t.first_log_odds = nan; }, "3 nodes from log odds nan to");
  for (const double edge : {nan, infinity}) {
    expect_refused([&](Table& t) { t.level_edges = {edge}; }, "level_edges[0] = ");
  }
  expect_refused([](Table& t) { t.level_edges = {5.0, 3.0}; }, "level_edges[1] = 3");
  expect_refused([](Table& t) { t.level_edges = {5.0, 5.0}; }, "level_edges[1] = 5");
  expect_refused([](Table& t) { t.level_edges = {1, 2, 3, 4, 5, 6, 7}; }, "9 levels");
  expect_refused([](Table& t) { t.log_likelihood.clear(); }, "0 numbers");
  expect_refused([](Table& t) { t.log_likelihood.pop_back(); }, "17 numbers");
  for (const double nats : {nan, infinity, -infinity, -2e30}) {
    expect_refused([&](Table& t) { t.log_likelihood[13] = nats; }, "log_likelihood[1, 1, 1] = ");
  }
}

TEST(LikelihoodTable, HasUpToEightLevels) {
  ContactModel model{.table = small_table()};
  model.table->level_edges = {1, 2, 3, 4, 5, 6};
  model.table->log_likelihood.assign(8 * 3, -1.0);
  model.validate();
  EXPECT_EQ(model.table->levels(), most_reading_levels);
  EXPECT_EQ(model.log_likelihood(contact_level(6), {0.5}), -1.0);
}

}  // namespace palpate::contact_model_test
