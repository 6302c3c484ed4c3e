#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "same.hpp"
#include "support/limits.hpp"

namespace palpate::posterior_test {

class PosteriorFile : public OneFile {
 protected:
  std::string message(const FileParts& parts) const {
    parts.save(path_);
    return refusal([&] { read_posterior(path_); });
  }
};

// Of chunks that hold a part of one object, one object, or several objects.
TEST_F(PosteriorFile, ComesBackAsItWasWrittenWholeOrObjectByObject) {
  for (const int thetas : {150, 70, 3}) {
    Posterior written{.objects = {"A", "B", "lång name", "", "E"},
                      .lattice = {.x_mm = {-10.5, 10, 47},
                                  .y_mm = {-5, 5.25, 29},
                                  .theta_rad = {-0.0, 6, thetas},
                                  .pivot_mm = {100, -3}}};
    const auto bins = static_cast<std::size_t>(written.lattice.bins());
    for (std::size_t k = 0; k < written.objects.size() * bins; ++k) {
      written.log_likelihood.push_back(-std::sqrt(static_cast<double>(k)));
    }
    written.log_likelihood[5] = -infinity;
    write_posterior(path_, written);
    const std::string bytes = bytes_of(path_);
    EXPECT_LT(bytes.size(), written.log_likelihood.size() * sizeof(double));
    const Posterior read = read_posterior(path_);
    EXPECT_EQ(read.objects, written.objects);
    EXPECT_EQ(read.log_likelihood, written.log_likelihood);
    for (const auto axis : {&PoseLattice::x_mm, &PoseLattice::y_mm, &PoseLattice::theta_rad}) {
      const auto ends = [&](const Axis& of) { return bits_of(std::vector{of.lower, of.upper}); };
      EXPECT_EQ(ends(read.lattice.*axis), ends(written.lattice.*axis));
      EXPECT_EQ((read.lattice.*axis).count, (written.lattice.*axis).count);
    }
    EXPECT_EQ(read.lattice.pivot_mm, written.lattice.pivot_mm);
    std::vector<std::size_t> asked;
    write_posterior(path_, written.objects, written.lattice, [&](std::size_t object) {
      asked.push_back(object);
      const double* first = written.log_likelihood.data() + object * bins;
      return std::vector<double>(first, first + bins);
    });
    EXPECT_EQ(asked, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
    EXPECT_TRUE(bytes_of(path_) == bytes);
  }
}

Posterior of_some_bins() {
  return {.objects = {"A", "B"},
          .lattice = {.x_mm = {-10, 10, 20}, .y_mm = {-5, 5, 10}, .theta_rad = {0, 6, 5}},
          .log_likelihood = {-3.0, -infinity, -1.5},
          .rest_mass_bound = 1e-7,
          .index = {0, 999, 1234}};
}

TEST_F(PosteriorFile, OfSomeBinsComesBackAsItWasWritten) {
  Posterior of_none = of_some_bins();  // where every bin is alike, none is evaluated by itself
  of_none.index.clear();
  of_none.log_likelihood.clear();
  of_none.rest_mass_bound = 1.0;
  for (const Posterior& written : {of_some_bins(), of_none}) {
    write_posterior(path_, written);
    const Posterior read = read_posterior(path_);
    EXPECT_EQ(read.objects, written.objects);
    EXPECT_EQ(read.lattice.bins(), 1000);
    EXPECT_EQ(read.index, written.index);
    EXPECT_EQ(read.log_likelihood, written.log_likelihood);
    EXPECT_EQ(read.rest_mass_bound, written.rest_mass_bound);
  }
}

TEST_F(PosteriorFile, ThatIsNotSoundIsNeverWritten) {
  Posterior of_all{.objects = {"A"},
                   .lattice = {{0, 1, 1}, {0, 1, 1}, {0, 1, 2}},
                   .log_likelihood = {-1.0, -2.0}};
  const auto expect_refused = [&](const char* named, Posterior posterior, const auto& spoil) {
    spoil(posterior);
    expect_named(refusal([&] { write_posterior(path_, posterior); }), {named});
  };
  expect_refused("'objects'", of_all, [](Posterior& p) { p.objects = {"\xff"}; });
  expect_refused("'objects'", of_all, [](Posterior& p) { p.objects.clear(); });
  expect_refused("y_mm", of_all, [](Posterior& p) { p.lattice.y_mm.count = -1; });
  expect_refused("pivot_mm", of_all, [](Posterior& p) { p.lattice.pivot_mm.x = nan; });
  expect_refused("1 log-likelihoods", of_all, [](Posterior& p) { p.log_likelihood.pop_back(); });
  expect_refused("inf", of_all, [](Posterior& p) { p.log_likelihood[1] = infinity; });
  const Posterior of_some = of_some_bins();
  expect_refused("2 bins and 3", of_some, [](Posterior& p) { p.index.pop_back(); });
  expect_refused("2000 is no bin of 2000", of_some, [](Posterior& p) { p.index[1] = 2000; });
  expect_refused("-1 is no bin", of_some, [](Posterior& p) { p.index[0] = -1; });
  expect_refused("nan", of_some, [](Posterior& p) { p.log_likelihood[0] = nan; });
  for (const double share : {-0.1, 1.1, nan}) {
    expect_refused("rest_mass_bound", of_some, [&](Posterior& p) { p.rest_mass_bound = share; });
  }
  constexpr Axis most{0, 1, std::numeric_limits<int>::max()};
  expect_refused("too many", of_some, [&](Posterior& p) { p.lattice = {most, most, most}; });
  for (const auto& [second, named] : {std::pair{std::vector{-1.0}, "'B'"},
                                      {std::vector{nan, -1.0}, "'log_likelihood' holds nan"}}) {
    const auto of_object = [&, &second = second](std::size_t object) {
      return object == 0 ? of_all.log_likelihood : second;
    };
    expect_named(refusal([&] {
                   write_posterior(path_, {"A", "B"}, of_all.lattice, of_object);
                 }),
                 {named});
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(PosteriorFile, OfSomeBinsNamesWhatItCannotTake) {
  const auto parts = [] {
    return posterior_parts()
        .attribute("version", 2)
        .attribute("rest_mass_bound", 0.25)
        .dataset("log_likelihood", {2}, -1.0)
        .dataset("index", {2, 4}, std::vector<double>{0, 3, 2, 1, 1, 0, 0, 0});
  };
  parts().save(path_);
  // 4 thetas of 3 x 2 bins.
  EXPECT_EQ(read_posterior(path_).index, (std::vector<std::int64_t>{23, 24}));
  for (const auto& [first, named] :
       {std::pair{std::vector<double>{0, 3, 2, 2}, "'index' holds 2 in column 3"},
        {{2, 3, 2, 1}, "2 in column 0"},
        {{0, -1, 2, 1}, "-1 in column 1"},
        {{0, 0.5, 2, 1}, "0.5 in column 1"}}) {
    std::vector<double> index = first;
    index.insert(index.end(), {1, 0, 0, 0});
    expect_named(message(parts().dataset("index", {2, 4}, index)), {named});
  }
  expect_named(message(parts().dataset("index", {1, 4})), {"'index'", "[1, 4]", "[2, 4]"});
  expect_named(message(parts().attribute("rest_mass_bound", 1.5)), {"'rest_mass_bound' = 1.5"});
  expect_named(message(parts().attribute("version", 3)), {"'version' = 3", "reads 2"});
  for (const char* name : {"index", "rest_mass_bound", "log_likelihood"}) {
    expect_named(message(parts().without(name)), {name, "missing"});
  }
}

TEST_F(PosteriorFile, NamesWhatItCannotTake) {
  const auto spoilt = [&](const char* name, auto value) {
    return message(posterior_parts().attribute(name, value));
  };
  expect_named(spoilt("bins_x", 3), {"'log_likelihood'", "[2, 4, 3, 2]", "[2, 4, 3, 3]"});
  expect_named(spoilt("objects", std::vector<std::string>{"A"}), {"'log_likelihood'"});
  expect_named(spoilt("bins_theta", 0), {"'bins_theta'", "0"});
  expect_named(spoilt("x_mm", std::vector<double>{1, -1}), {"x_mm", "reversed"});
  expect_named(spoilt("y_mm", std::vector<double>{1, nan}), {"'y_mm'", "nan"});
  expect_named(spoilt("format", "palpate.map"), {"a map", "posterior"});
  expect_named(message(posterior_parts().dataset("log_likelihood", {2, 4, 3, 2}, nan)),
               {"'log_likelihood'", "nan"});
  for (const char* name : {"objects", "bins_x", "bins_y", "bins_theta", "x_mm", "y_mm", "theta_rad",
                           "pivot_mm", "log_likelihood"}) {
    expect_named(message(posterior_parts().without(name)), {name, "missing"});
  }
}

}  // namespace palpate::posterior_test
