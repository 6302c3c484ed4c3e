// Sizes, places and labels that recognition cannot take.

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::recognize_bounds_test {

class RecognizeBounds : public ProgramTest {
 protected:
  RecognizeBounds() {
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 3));
    write_map(folder_ / "A.map.h5", sample_map("A"));
  }

  void refuse(std::vector<std::string> flags, const std::vector<std::string>& named) {
    flags.insert(flags.begin(), {"recognize", "u.h5", "--maps", "A.map.h5"});
    flags.insert(flags.end(), {"--json", "r.json", "--png", "new"});
    expect_refused(flags, named);
  }
};

TEST_F(RecognizeBounds, BinsBeyondTheDeviceAreTheUsersNumber) {
  refuse({"--bins", "2000000000x1x1"}, {"bins", "use fewer"});
  refuse({"--bins", "1x2000000000x1"}, {"bins", "use fewer"});
  refuse({"--bins", "1x1x2000000000"}, {"bins", "use fewer"});
  refuse({"--bins", "80000x80000x1000"}, {"80000 x 80000 x 1000 pose bins", "use fewer"});
  refuse({"--bins", "2000000000x2000000000x2000000000"}, {"pose bins", "use fewer"});
}

TEST_F(RecognizeBounds, RegionsAndPivotsBeyondAnyRobotAreNamed) {
  refuse({"--x-mm=-1e200:1e200"}, {"--x-mm", "-1e200:1e200", "+-1e+09"});
  refuse({"--y-mm=0:2e9"}, {"--y-mm", "0:2e9", "+-1e+09"});
  refuse({"--theta-deg=0:1e200"}, {"--theta-deg", "0:1e200"});
  refuse({"--pivot-mm=1e+200,0"}, {"--pivot-mm", "1e+200"});
  put_bytes(folder_ / "scene.yaml", "region: {x_mm: [0, 1e200]}\n");
  refuse({"--scene", "scene.yaml"}, {"x_mm", "0:1e200"});
}

TEST_F(RecognizeBounds, TheLabelOfObjectsThatWereNeverLearnedIsRefused) {
  put_bytes(folder_ / "scene.yaml", "objects: [{map: A.map.h5, label: (none)}]\n");
  for (const bool with_none : {false, true}) {
    std::vector<std::string> arguments{"recognize", "u.h5", "--scene", "scene.yaml"};
    if (with_none) {
      arguments.insert(arguments.end(), {"--none", "1"});
    }
    expect_refused(arguments, {"A.map.h5", "(none)", "label"});
  }
}

}  // namespace palpate::recognize_bounds_test
