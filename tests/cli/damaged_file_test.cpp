// libhdf5 is known to crash and to loop on damaged files; the command must do neither.

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
    OccupancyGrid map{.label = "A", .nx = 4, .ny = 4};
    map.log_odds.assign(16, 1.0F);
    write_map(folder_ / "A.map.h5", map);
    // Unlike the others a compressed file.
    Posterior posterior;
    posterior.objects = {"A", "B"};
    posterior.lattice.theta_rad.count = 2;
    posterior.log_likelihood.assign(2u * 2 * 25 * 25, -3.0);
    write_posterior(folder_ / "p.h5", posterior);
  }

  /// The bytes cut short, or with a bit flipped. Beyond its first pages a file is mostly values,
  /// few of which can be wrong.
  std::string damaged(std::string bytes, int kind) {
    const auto below = [&](std::size_t bound) { return random_() % bound; };
    if (kind == 0) {
      bytes.resize(below(bytes.size()));
    } else {
      char& byte =
          bytes[below(kind == 1 ? bytes.size() : std::min<std::size_t>(2048, bytes.size()))];
      byte = static_cast<char>(byte ^ (1 << below(8)));
    }
    return bytes;
  }

  std::mt19937 random_{20110509};
};

TEST_F(DamagedInput, IsReadOrRefusedInOneLine) {
  const std::string recognize =
      "recognize u.h5 --maps A.map.h5 --bins 5x5x4 --json - --filter=bounded";
  for (const auto& [name, command, damages] :
       {std::tuple<std::string, std::string, int>{"u.h5", "info u.h5", 18},
        {"A.map.h5", "info A.map.h5", 18},
        {"p.h5", "info p.h5", 18},
        {"u.h5", recognize, 6},
        {"A.map.h5", recognize, 6}}) {
    const std::string good = bytes_of(folder_ / name);
    int refused = 0;
    for (int k = 0; k < damages; ++k) {
      SCOPED_TRACE(command + ", damage " + std::to_string(k));
      put_bytes(folder_ / name, damaged(good, k % 3));
      const auto [status, out, err] = palpate(command);
      if (status == 0) {
        EXPECT_EQ(err, "");
        continue;
      }
      ++refused;
      EXPECT_EQ(status, 2) << err;
      EXPECT_EQ(out, "");
      // A sanitizer gives its own account of a crash before the line.
      const std::size_t at = err.rfind("palpate: ");
      EXPECT_TRUE(at == 0 || (sanitized && at != err.npos)) << err;
      EXPECT_EQ(err.find('\n', at), err.size() - 1) << err;
      EXPECT_NE(err.find(name, at), err.npos) << err;
    }
    EXPECT_GE(refused, damages / 3) << "every truncated file is refused";
    put_bytes(folder_ / name, good);
  }
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
  done("info linked.h5");
  change("/away/pressure");
  expect_refused("info linked.h5", {"linked.h5", "'pressure'", "link"});
}

}  // namespace palpate::damaged_file_test
