#include "recognition/evaluation.hpp"

#include <cmath>
#include <span>
#include <vector>

#include <gmock/gmock.h>

namespace palpate::evaluation_test {

using testing::ElementsAre;

JudgedRecord record(const std::string& truth, const std::string& best, double a, double b,
                    double none) {
  return {.truth = truth,
          .best = best,
          .identity = {{"A", a}, {"B", b}, {"(none)", none}},
          .none = none,
          .fit_z = {},
          .error_mm = {},
          .refined_error_mm = {}};
}

/// Four records of known classes, of which two are right, and two of M, which no map has.
std::vector<JudgedRecord> six() {
  return {record("A", "A", 0.9, 0.1, 0.0),      record("A", "B", 0.2, 0.8, 0.0),
          record("B", "B", 0.05, 0.95, 0.0),    record("B", "(none)", 0.1, 0.3, 0.6),
          record("M", "(none)", 0.2, 0.1, 0.7), record("M", "A", 0.85, 0.1, 0.05)};
}

TEST(Evaluation, CountsWhatIsRightAndItsLogLoss) {
  const Evaluation e = evaluate(six());
  EXPECT_EQ(e.all.records, 6u);
  EXPECT_EQ(e.all.right, 3u) << "M is \"(none)\"";
  EXPECT_DOUBLE_EQ(e.all.accuracy(), 0.5);
  EXPECT_DOUBLE_EQ(e.all.interval().low, wilson_interval(3, 6).low);
  EXPECT_NEAR(e.all.log_loss, 1.0537453, 1e-6) << "-ln(0.9 0.2 0.95 0.3 0.7 0.05) / 6";
  EXPECT_EQ(e.known.value().records, 4u);
  EXPECT_EQ(e.known->right, 2u);
  EXPECT_NEAR(e.known->log_loss, 0.7425161, 1e-6) << "-ln(0.9 0.2 0.95 0.3) / 4";
  EXPECT_EQ(e.unknown.value().records, 2u);
  EXPECT_EQ(e.unknown->right, 1u);

  const auto known_alone = six();
  const Evaluation without = evaluate(std::span(known_alone).first(4));
  EXPECT_FALSE(without.known || without.unknown || without.known_against_unknown);
}

TEST(Evaluation, AnImpossibleAnswerCostsTheFloor) {
  std::vector wrong{record("A", "B", 0.0, 1.0, 0.0), record("M", "B", 0.0, 1.0, 0.0)};
  wrong[1].identity.erase("(none)");
  for (const JudgedRecord& each : wrong) {
    EXPECT_NEAR(evaluate(std::span(&each, 1)).all.log_loss, 27.631, 1e-3) << "-ln 1e-12";
  }
}

TEST(Evaluation, CalibrationErrorWeighsTheBinsByTheirRecords) {
  const Evaluation e = evaluate(six());
  // 0.6: one, wrong; 0.7: one, right; 0.8 and 0.85: both wrong; 0.9 and 0.95: both right.
  EXPECT_NEAR(e.all.calibration_error, (0.6 + 0.3 + 2 * 0.825 + 2 * 0.075) / 6, 1e-12);
  EXPECT_NEAR(e.known->calibration_error, (0.6 + 0.8 + 2 * 0.075) / 4, 1e-12);
  const ReliabilityBin& bin = e.all.bins[8];
  EXPECT_DOUBLE_EQ(bin.lower, 0.8);
  EXPECT_DOUBLE_EQ(bin.upper, 0.9);
  EXPECT_EQ(bin.records, 2u);
  EXPECT_EQ(bin.right, 0u);
  EXPECT_DOUBLE_EQ(bin.mean_confidence, 0.825);
  EXPECT_EQ(e.all.bins[0].records, 0u);
  // A bin holds its lower end, and the last one both.
  const std::vector ends{record("A", "A", 0.5, 0.5, 0.0), record("A", "A", 1.0, 0.0, 0.0)};
  EXPECT_EQ(evaluate(ends).all.bins[5].records, 1u);
  EXPECT_EQ(evaluate(ends).all.bins[9].records, 1u);
}

TEST(Evaluation, ListsClassesAndWhatTheyWereTakenFor) {
  const Evaluation e = evaluate(six());
  EXPECT_THAT(e.answers, ElementsAre("A", "B", "(none)"));
  ASSERT_EQ(e.classes.size(), 3u);
  EXPECT_EQ(e.classes[0].label, "A");
  EXPECT_EQ(e.classes[0].right, 1u);
  EXPECT_DOUBLE_EQ(e.classes[0].accuracy(), 0.5);
  EXPECT_THAT(e.classes[0].taken, ElementsAre(1, 1, 0));
  EXPECT_THAT(e.classes[1].taken, ElementsAre(0, 1, 1));
  EXPECT_EQ(e.classes[2].label, "M");
  EXPECT_FALSE(e.classes[2].known);
  EXPECT_EQ(e.classes[2].right, 1u);
  EXPECT_THAT(e.classes[2].taken, ElementsAre(1, 0, 1));
}

TEST(Evaluation, AClassMayBeKnownInSomeRecordsOnly) {
  std::vector<JudgedRecord> records = six();
  records.push_back(record("B", "(none)", 0.1, 0.0, 0.9));
  records.back().identity.erase("B");
  const Evaluation e = evaluate(records);
  ASSERT_EQ(e.classes.size(), 4u);
  EXPECT_EQ(e.classes[1].label, "B");
  EXPECT_EQ(e.classes[1].records, 2u);
  EXPECT_EQ(e.classes[2].label, "B");
  EXPECT_FALSE(e.classes[2].known);
  EXPECT_EQ(e.classes[2].right, 1u);
}

TEST(KnownAgainstUnknown, PrefersNoneToTheFit) {
  std::vector<JudgedRecord> records = six();
  const auto by_none = evaluate(records).known_against_unknown.value();
  EXPECT_EQ(by_none.score, "1 - none");
  EXPECT_EQ(by_none.known, 4u);
  EXPECT_EQ(by_none.unknown, 2u);
  EXPECT_DOUBLE_EQ(by_none.area, 7.0 / 8.0) << "1, 1, 1, 0.4 against 0.3, 0.95";
  EXPECT_DOUBLE_EQ(by_none.standard_error, told_apart_error(7.0 / 8.0, 2, 4));

  for (JudgedRecord& each : records) {
    each.fit_z = each.of_known_class() ? 0.5 : -0.1;
  }
  EXPECT_EQ(evaluate(records).known_against_unknown->score, "1 - none");
  records[0].none.reset();
  const auto by_fit = evaluate(records).known_against_unknown.value();
  EXPECT_EQ(by_fit.score, "fit.z") << "one record has no other score";
  EXPECT_EQ(by_fit.area, 1.0);
}

TEST(KnownAgainstUnknown, TakesTheFitOfTheRecordsThatHaveOne) {
  std::vector<JudgedRecord> records = six();
  for (JudgedRecord& each : records) {
    each.none.reset();
  }
  EXPECT_FALSE(evaluate(records).known_against_unknown);
  records[0].fit_z = -1.0;
  EXPECT_FALSE(evaluate(records).known_against_unknown) << "of one kind alone";
  records[1].fit_z = -4.0;
  records[5].fit_z = -3.0;
  const auto by_fit = evaluate(records).known_against_unknown.value();
  EXPECT_EQ(by_fit.score, "fit.z");
  EXPECT_EQ(by_fit.known, 2u);
  EXPECT_EQ(by_fit.unknown, 1u);
  EXPECT_DOUBLE_EQ(by_fit.area, 0.5);
}

TEST(Evaluation, MediansAreOverTheRecordsThatHaveAnError) {
  std::vector<JudgedRecord> records = six();
  EXPECT_FALSE(evaluate(records).error_mm);
  records[0].error_mm = 5.0;
  records[1].error_mm = 1.0;
  records[2].error_mm = 2.0;
  records[3].error_mm = 3.0;
  records[2].refined_error_mm = 0.25;
  const Evaluation e = evaluate(records);
  EXPECT_EQ(e.error_mm.value().count, 4u);
  EXPECT_DOUBLE_EQ(e.error_mm->value, 2.5);
  EXPECT_EQ(e.refined_error_mm.value().count, 1u);
  EXPECT_DOUBLE_EQ(e.refined_error_mm->value, 0.25);
}

TEST(WilsonInterval, HasThePublishedEnds) {
  // Newcombe 1998, table I: 81 of 263 and 0 of 20, to four digits.
  EXPECT_NEAR(wilson_interval(81, 263).low, 0.2553, 5e-5);
  EXPECT_NEAR(wilson_interval(81, 263).high, 0.3662, 5e-5);
  EXPECT_EQ(wilson_interval(0, 20).low, 0.0);
  EXPECT_NEAR(wilson_interval(0, 20).high, 0.1611, 5e-5);
  EXPECT_EQ(wilson_interval(20, 20).high, 1.0);
}

TEST(ToldApart, CountsPairsAndHalfOfTies) {
  const std::vector higher{0.9, 0.4, 0.8};
  const std::vector lower{0.5, 0.4};
  // 0.9 and 0.8 exceed both, 0.4 is a tie with 0.4 and below 0.5.
  EXPECT_DOUBLE_EQ(told_apart(lower, higher), 4.5 / 6.0);
  EXPECT_DOUBLE_EQ(told_apart(higher, lower), 1.5 / 6.0);
  EXPECT_DOUBLE_EQ(told_apart(std::vector{0.0}, higher), 1.0);
}

TEST(ToldApart, HasTheErrorOfHanleyAndMcNeil) {
  // Area 0.75, two and three values: Q1 = 0.75 / 1.25 = 0.6, Q2 = 2 * 0.5625 / 1.75 = 0.642857;
  // (0.1875 + 2 * 0.0375 + 1 * 0.080357) / 6 = 0.0571429.
  EXPECT_NEAR(told_apart_error(0.75, 2, 3), std::sqrt(0.0571429), 1e-6);
  // Their example of 58 normal and 51 abnormal images, with an area of 0.893.
  EXPECT_NEAR(told_apart_error(0.893, 58, 51), 0.0325, 5e-5);
  EXPECT_EQ(told_apart_error(1.0, 4, 5), 0.0);
  EXPECT_EQ(told_apart_error(0.0, 4, 5), 0.0);
  EXPECT_NEAR(told_apart_error(0.5, 1, 1), 0.5, 1e-12);
}

}  // namespace palpate::evaluation_test
