// The program in docs/files.md writes a recording that the commands take.

#include <cstdlib>

#include "document.hpp"
#include "palpate/files.hpp"

namespace palpate::files_test {

using FilesDocument = ProgramTest;

TEST_F(FilesDocument, ItsProgramWritesARecording) {
  const std::string document = source_text("docs/files.md");
  const std::string opening = "```python\n";
  const auto begin = document.find(opening);
  ASSERT_NE(begin, document.npos);
  const auto end = document.find("```", begin + opening.size());
  put_bytes(folder_ / "write.py",
            document.substr(begin + opening.size(), end - begin - opening.size()));
  const std::string command = "cd '" + folder_.path().string() + "' && /usr/bin/python3 write.py";
  ASSERT_EQ(std::system(command.c_str()), 0) << "needs the package python3-h5py";
  expect_named(done({"info", "disc.h5"}), {"recording of disc", "touches           25",
                                           "elements          36", "0.5 to 12 kPa"});
  done({"map", "disc.h5", "-o", "disc.map.h5"});
  const OccupancyGrid map = read_map(folder_ / "disc.map.h5");
  double area_mm2 = 0.0;
  for (const float cell : map.log_odds) {
    area_mm2 += cell > 0.0F ? map.cell_mm * map.cell_mm : 0.0;
  }
  // A disc with a radius of 8 mm has 201 mm2; elements 2 mm apart show its edge to half of that.
  EXPECT_NEAR(area_mm2, 201.0, 50.0);
}

}  // namespace palpate::files_test
