// The posterior that `palpate recognize` writes.

#include <algorithm>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::recognize_posterior_test {

class RecognizePosterior : public ProgramTest {
 protected:
  RecognizePosterior() {
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
  }

  nlohmann::json u(std::vector<std::string> flags) const {
    flags.insert(flags.begin(), {"u.h5", "--maps", "maps", "--touches=2", "--bins=7x6x5"});
    return record(flags);
  }
};

TEST_F(RecognizePosterior, IsTheRecordsSource) {
  const nlohmann::json r = u({"--posterior=p.h5", "--none=0"});
  const Posterior p = read_posterior(folder_ / "p.h5");
  EXPECT_FALSE(p.rest_mass_bound) << "auto writes every bin";
  EXPECT_EQ(p.objects, (std::vector<std::string>{"A", "I"}));
  EXPECT_EQ(std::tuple(p.lattice.x_mm.count, p.lattice.y_mm.count, p.lattice.theta_rad.count),
            std::tuple(7, 6, 5));
  const auto bins = static_cast<std::size_t>(p.lattice.bins());
  ASSERT_EQ(p.log_likelihood.size(), 2 * bins);
  const auto most = std::max_element(p.log_likelihood.begin(), p.log_likelihood.end());
  const auto index = static_cast<std::size_t>(most - p.log_likelihood.begin());
  EXPECT_EQ(r["mode"]["object"], p.objects[index / bins]);
  const Pose T_object_robot = p.lattice.T_object_robot(static_cast<std::int64_t>(index % bins));
  EXPECT_DOUBLE_EQ(r["mode"]["x_mm"].get<double>(), T_object_robot.translation_mm.x);
  EXPECT_DOUBLE_EQ(r["mode"]["log_likelihood"].get<double>(), *most);

  for (const char* ask : {"--filter=bounded", "--tolerance=1e-3"}) {
    const nlohmann::json bounded = u({ask, "--posterior=some.h5"});
    const Posterior some = read_posterior(folder_ / "some.h5");
    EXPECT_EQ(some.objects, p.objects);
    EXPECT_EQ(some.lattice.bins(), p.lattice.bins());
    EXPECT_EQ(some.index.size(), bounded["bins_evaluated"]);
    ASSERT_TRUE(some.rest_mass_bound);
    EXPECT_GE(*some.rest_mass_bound, bounded["dropped_mass"].get<double>());
    EXPECT_LT(*some.rest_mass_bound, 1e-3);
    for (std::size_t i = 0; i < some.index.size(); ++i) {
      EXPECT_NEAR(some.log_likelihood[i], p.log_likelihood[static_cast<std::size_t>(some.index[i])],
                  1e-3);
    }
  }
}

}  // namespace palpate::recognize_posterior_test
