// libhdf5 is known to crash and to loop on damaged files; the command must do neither.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "io/file_parts.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"
#include "support/sanitized.hpp"

namespace palpate::damaged_file_test {

class DamagedInput : public ProgramTest {
 protected:
  DamagedInput() {
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 2));
    OccupancyGrid map;
    map.label = "A";
    map.nx = 4;
    map.ny = 4;
    map.log_odds.assign(16, 1.0F);
    write_map(folder_ / "A.map.h5", map);
  }

  const std::vector<std::string> recognize_{"recognize", "u.h5",   "--maps",
                                            "A.map.h5",  "--bins", "5x5x4",
                                            "--json",    "-",      "--filter=bounded"};

  /// Spoils the file in many ways and runs the program on it: done, or refused in one line.
  void expect_robust(const char* name, const std::vector<std::string>& arguments,
                     int damages = 18) const {
    const std::string good = bytes_of(folder_ / name);
    std::mt19937 random(20110509);
    const auto below = [&](std::size_t bound) { return random() % bound; };
    int refused = 0;
    for (int k = 0; k < damages; ++k) {
      std::string bytes = good;
      if (k % 3 == 0) {
        bytes.resize(below(good.size()));
      } else {
        // Beyond its first pages a file is mostly values, few of which can be wrong.
        char& byte =
            bytes[below(k % 3 == 1 ? good.size() : std::min<std::size_t>(2048, good.size()))];
        byte = static_cast<char>(byte ^ (1 << below(8)));
      }
      put_bytes(folder_ / name, bytes);
      const Outcome outcome = palpate(arguments);
      SCOPED_TRACE(k);
      if (outcome.status == 0) {
        EXPECT_EQ(outcome.err, "");
        continue;
      }
      ++refused;
      EXPECT_EQ(outcome.status, 2) << outcome.err;
      EXPECT_EQ(outcome.out, "");
      const std::size_t end = outcome.err.rfind("palpate: ");
      const std::string line = outcome.err.substr(std::min(end, outcome.err.size()));
      // A sanitizer gives its own account of a crash before the line.
      EXPECT_TRUE(end == 0 || sanitized) << outcome.err;
      EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << outcome.err;
      EXPECT_NE(line.find(name), std::string::npos) << outcome.err;
    }
    EXPECT_GE(refused, damages / 3) << "every truncated file is refused";
  }
};

TEST_F(DamagedInput, UnknownIsRecognisedOrRefused) { expect_robust("u.h5", recognize_); }

TEST_F(DamagedInput, UnknownWithADamagedMapIsRecognisedOrRefused) {
  expect_robust("A.map.h5", recognize_);
}

TEST_F(DamagedInput, RecordingIsReadOrRefused) { expect_robust("u.h5", {"info", "u.h5"}, 100); }

TEST_F(DamagedInput, MapIsReadOrRefused) { expect_robust("A.map.h5", {"info", "A.map.h5"}, 100); }

// Unlike the others a compressed file.
TEST_F(DamagedInput, PosteriorIsReadOrRefused) {
  Posterior posterior;
  posterior.objects = {"A", "B"};
  posterior.lattice.theta_rad.count = 2;
  posterior.log_likelihood.assign(2u * 2 * 25 * 25, -3.0);
  write_posterior(folder_ / "p.h5", posterior);
  expect_robust("p.h5", {"info", "p.h5"}, 100);
}

// Within the file a link is as good as the dataset; to another file, on whatever way, it is none.
TEST_F(DamagedInput, LinksAreFollowedWithinTheFile) {
  const auto change = [&](const char* target) {
    recording_parts().save(folder_ / "linked.h5");
    edit(folder_ / "linked.h5", [&](hid_t file) {
      H5Lmove(file, "pressure", file, "numbers", H5P_DEFAULT, H5P_DEFAULT);
      H5Lcreate_external("u.h5", "/", file, "away", H5P_DEFAULT, H5P_DEFAULT);
      H5Lcreate_soft(target, file, "pressure", H5P_DEFAULT, H5P_DEFAULT);
    });
  };
  change("/numbers");
  done({"info", "linked.h5"});
  change("/away/pressure");
  expect_refused({"info", "linked.h5"}, {"linked.h5", "'pressure'", "link"});
}

}  // namespace palpate::damaged_file_test
