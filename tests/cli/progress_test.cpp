#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "program.hpp"
#include "sample_files.hpp"

namespace palpate {
namespace {

class ProgressLine : public ProgramTest {
 protected:
  ProgressLine() {
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 24));
  }

  static std::vector<std::string> work(int bins) {
    return {"recognize",    "u.h5",   "--maps",
            "A.map.h5",     "--bins", fmt::format("{0}x{0}x16", bins),
            "--each-frame", "--json", "r.json"};
  }

  /// What the program shows on a terminal.
  std::string shown(const std::vector<std::string>& arguments) const {
    const Outcome outcome = ProgramOnTerminal(folder_.path(), arguments).finish();
    EXPECT_EQ(outcome.status, 0) << outcome.out;
    return outcome.out;
  }
};

TEST_F(ProgressLine, IsShownOnATerminalOnlyAndErased) {
  // Grows until this machine is busy for well over the two seconds that pass in silence.
  double elapsed_s = 0.0;
  int bins = 0;
  std::string text;
  while (elapsed_s < 6.0) {
    // Time grows with the square of the bins along x and y.
    bins = bins == 0 ? 60 : static_cast<int>(bins * std::max(1.1, std::sqrt(3.6 / elapsed_s)));
    const auto start = std::chrono::steady_clock::now();
    text = shown(work(bins));
    ASSERT_FALSE(HasFailure());
    elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  const std::string erase = "\r\033[K";
  const std::size_t last = text.rfind("\rrecognising ");
  ASSERT_NE(last, std::string::npos) << text;
  const std::size_t erased = text.find(erase, last);
  ASSERT_NE(erased, std::string::npos) << text;
  EXPECT_EQ(text.find("recognising", erased), std::string::npos);
  EXPECT_LT(erased, text.find("recording  touches")) << "erased before the table is printed";
  // The same work, where standard error is a file.
  done(work(bins));
}

TEST_F(ProgressLine, IsNotShownForShortWork) {
  EXPECT_EQ(shown(work(5)).find("recognising"), std::string::npos);
}

}  // namespace
}  // namespace palpate
