#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::posterior_test {

class PosteriorFile : public testing::Test {
 protected:
  std::string message(const FileParts& parts) {
    parts.save(path_);
    const std::string text = input_error([&] { read_posterior(path_); });
    expect_named(text, {path_.c_str()});
    return text;
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "posterior.h5";
};

TEST_F(PosteriorFile, ComesBackAsItWasWritten) {
  Posterior written;
  written.objects = {"A", "B", "lång name"};
  written.lattice.x_mm = {-10, 10, 70};
  written.lattice.y_mm = {-5, 5, 50};
  written.lattice.theta_rad = {0, 6, 40};
  written.lattice.pivot_mm = {100, -3};
  // More than one chunk.
  for (std::size_t k = 0; k < 3u * 70 * 50 * 40; ++k) {
    written.log_likelihood.push_back(-std::sqrt(static_cast<double>(k)));
  }
  written.log_likelihood[5] = -std::numeric_limits<double>::infinity();
  write_posterior(path_, written);
  const Posterior read = read_posterior(path_);
  EXPECT_EQ(read.objects, written.objects);
  EXPECT_EQ(read.log_likelihood, written.log_likelihood);
  EXPECT_EQ(read.lattice.x_mm.lower, -10);
  EXPECT_EQ(read.lattice.x_mm.count, 70);
  EXPECT_EQ(read.lattice.y_mm.upper, 5);
  EXPECT_EQ(read.lattice.y_mm.count, 50);
  EXPECT_EQ(read.lattice.theta_rad.upper, 6);
  EXPECT_EQ(read.lattice.theta_rad.count, 40);
  EXPECT_EQ(read.lattice.pivot_mm, glm::dvec2(100, -3));
  EXPECT_LT(std::filesystem::file_size(path_), written.log_likelihood.size() * sizeof(double));
}

Posterior of_some_bins() {
  return {.objects = {"A", "B"},
          .lattice = {.x_mm = {-10, 10, 20}, .y_mm = {-5, 5, 10}, .theta_rad = {0, 6, 5}},
          .log_likelihood = {-3.0, -std::numeric_limits<double>::infinity(), -1.5},
          .rest_mass_bound = 1e-7,
          .index = {0, 999, 1234}};
}

TEST_F(PosteriorFile, OfSomeBinsComesBackAsItWasWritten) {
  Posterior written = of_some_bins();
  for (int run = 0; run < 2; ++run) {
    write_posterior(path_, written);
    const Posterior read = read_posterior(path_);
    EXPECT_EQ(read.objects, written.objects);
    EXPECT_EQ(read.lattice.bins(), 1000);
    EXPECT_EQ(read.index, written.index);
    EXPECT_EQ(read.log_likelihood, written.log_likelihood);
    EXPECT_EQ(read.rest_mass_bound, written.rest_mass_bound);
    // Where every bin is alike, none is evaluated by itself.
    written.index.clear();
    written.log_likelihood.clear();
    written.rest_mass_bound = 1.0;
  }
}

TEST_F(PosteriorFile, OfSomeBinsThatIsNotSoundIsNeverWritten) {
  const auto refusal = [&](const std::function<void(Posterior&)>& spoil) {
    Posterior posterior = of_some_bins();
    spoil(posterior);
    const std::string text = input_error([&] { write_posterior(path_, posterior); });
    expect_named(text, {path_.c_str()});
    return text;
  };
  expect_named(refusal([](Posterior& p) { p.index.pop_back(); }), {"2 bins", "3 log-likelihoods"});
  expect_named(refusal([](Posterior& p) { p.index[1] = 2000; }), {"2000 is no bin of 2000"});
  expect_named(refusal([](Posterior& p) { p.index[0] = -1; }), {"-1 is no bin"});
  expect_named(refusal([](Posterior& p) { p.log_likelihood[0] = NAN; }), {"nan"});
  for (const double share : {-0.1, 1.1, static_cast<double>(NAN)}) {
    expect_named(refusal([&](Posterior& p) { p.rest_mass_bound = share; }), {"rest_mass_bound"});
  }
  constexpr int most = std::numeric_limits<int>::max();
  expect_named(refusal([](Posterior& p) {
                 p.lattice.x_mm.count = p.lattice.y_mm.count = p.lattice.theta_rad.count = most;
               }),
               {"too many to be numbered"});
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
  const auto with_index = [&](const std::vector<double>& index) {
    return message(parts().dataset("index", {index.size() / 4, 4}, index));
  };
  expect_named(with_index({0, 3, 2, 2, 1, 0, 0, 0}), {"'index'", "2 in column 3", "here 2"});
  expect_named(with_index({0, 3, 2, 1, 2, 0, 0, 0}), {"2 in column 0"});
  expect_named(with_index({0, -1, 2, 1, 1, 0, 0, 0}), {"-1 in column 1"});
  expect_named(with_index({0, 0.5, 2, 1, 1, 0, 0, 0}), {"0.5 in column 1"});
  expect_named(with_index({0, 3, 2, 1}), {"'index'", "[1, 4]", "[2, 4]"});
  expect_named(message(parts().attribute("rest_mass_bound", 1.5)), {"'rest_mass_bound' = 1.5"});
  expect_named(message(parts().attribute("version", 3)), {"'version' = 3", "reads 2"});
  for (const char* name : {"index", "rest_mass_bound", "log_likelihood"}) {
    expect_named(message(parts().without(name)), {name, "missing"});
  }
}

TEST_F(PosteriorFile, WrittenObjectByObjectIsTheSameFile) {
  // Chunks that hold a part of one object, one object, and several objects.
  for (const int thetas : {150, 70, 3}) {
    Posterior whole;
    whole.objects = {"A", "B", "C", "D", "E"};
    whole.lattice.x_mm.count = 47;
    whole.lattice.y_mm.count = 29;
    whole.lattice.theta_rad.count = thetas;
    const auto bins = static_cast<std::size_t>(whole.lattice.bins());
    for (std::size_t k = 0; k < whole.objects.size() * bins; ++k) {
      whole.log_likelihood.push_back(-std::sqrt(static_cast<double>(k)));
    }
    std::vector<std::size_t> asked;
    write_posterior(path_, whole.objects, whole.lattice, [&](std::size_t object) {
      asked.push_back(object);
      const double* first = whole.log_likelihood.data() + object * bins;
      return std::vector<double>(first, first + bins);
    });
    EXPECT_EQ(asked, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
    EXPECT_EQ(read_posterior(path_).log_likelihood, whole.log_likelihood);
  }
}

TEST_F(PosteriorFile, OfAnObjectThatIsNotSoundIsNeverWritten) {
  const PoseLattice lattice;
  const auto bins = static_cast<std::size_t>(lattice.bins());
  const auto refusal = [&](const std::vector<double>& second) {
    return input_error([&] {
      write_posterior(path_, {"A", "B"}, lattice, [&](std::size_t object) {
        return object == 0 ? std::vector<double>(bins, -1.0) : second;
      });
    });
  };
  expect_named(refusal(std::vector<double>(bins - 1, -1.0)), {path_.c_str(), "'B'", "9999"});
  expect_named(refusal(std::vector<double>(bins, NAN)), {"'log_likelihood'", "nan"});
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(PosteriorFile, NamesWhatItCannotTake) {
  const auto spoilt = [&](const char* name, auto value) {
    return message(posterior_parts().attribute(name, value));
  };
  expect_named(spoilt("bins_x", 3), {"'log_likelihood'", "[2, 4, 3, 2]", "[2, 4, 3, 3]"});
  expect_named(spoilt("objects", std::vector<std::string>{"A"}), {"'log_likelihood'"});
  expect_named(spoilt("bins_theta", 0), {"'bins_theta'", "0"});
  expect_named(spoilt("x_mm", std::vector<double>{1, -1}), {"x_mm", "reversed"});
  expect_named(spoilt("y_mm", std::vector<double>{1, NAN}), {"'y_mm'", "nan"});
  expect_named(spoilt("format", "palpate.map"), {"a map", "posterior"});
  expect_named(message(posterior_parts().dataset("log_likelihood", {2, 4, 3, 2}, NAN)),
               {"'log_likelihood'", "nan"});
  for (const char* name : {"objects", "bins_x", "bins_y", "bins_theta", "x_mm", "y_mm", "theta_rad",
                           "pivot_mm", "log_likelihood"}) {
    expect_named(message(posterior_parts().without(name)), {name, "missing"});
  }
}

}  // namespace palpate::posterior_test
