// Damaged files through the whole program; tests/io does the same to the readers by the hundreds.

#include <algorithm>
#include <random>

#include "program.hpp"
#include "sample_files.hpp"

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
  void expect_robust(const char* name, const std::vector<std::string>& arguments) const {
    const std::string good = bytes_of(folder_ / name);
    std::mt19937 random(20110509);
    const auto below = [&](std::size_t bound) { return random() % bound; };
    int refused = 0;
    for (int k = 0; k < 18; ++k) {
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
      EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
      EXPECT_NE(outcome.err.find(name), std::string::npos) << outcome.err;
    }
    EXPECT_GE(refused, 6) << "every truncated file is refused";
  }
};

TEST_F(DamagedInput, RecordingIsReadOrRefused) { expect_robust("u.h5", recognize_); }

TEST_F(DamagedInput, RecordingIsSurveyedOrRefused) { expect_robust("u.h5", {"info", "u.h5"}); }

TEST_F(DamagedInput, MapIsReadOrRefused) { expect_robust("A.map.h5", recognize_); }

}  // namespace palpate::damaged_file_test
