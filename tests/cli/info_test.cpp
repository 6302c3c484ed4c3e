#include <cmath>

#include "program.hpp"
#include "sample_files.hpp"

namespace palpate {
namespace {

class InfoCommand : public ProgramTest {
 protected:
  void expect_info(const char* file, std::initializer_list<const char*> parts) const {
    expect_named(done({"info", file}), parts);
  }
};

TEST_F(InfoCommand, Recording) {
  write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
  expect_info("u.h5", {"u.h5: recording of an unknown object", "touches           6",
                       "elements          36", "kPa", "A at x 2.000 mm, y -3.000 mm"});
  write_recording(folder_ / "A.h5", sample_training("A", 2));
  expect_info("A.h5", {"recording of A"});
}

TEST_F(InfoCommand, RawStreamOfAChangingArray) {
  Recording stream = sample_training("A", 2);
  stream.rows = "frames";
  stream.pressure_unit = "raw";
  stream.time_s = {1.7e9, 1.7e9 + 2.5};
  stream.elements_mm.resize(2 * stream.elements());
  write_recording(folder_ / "s.h5", stream);
  expect_info("s.h5", {"frames           2", "raw", "positions change", "2.500 s"});
}

TEST_F(InfoCommand, DeadElementsDoNotCountAmongThePressures) {
  Recording recording = sample_training("A", 1);
  recording.pressure.assign(recording.elements(), 1.5);
  recording.valid.assign(recording.elements(), 1);
  recording.valid[3] = 0;
  recording.valid[4] = 0;
  recording.pressure[3] = 4000.0;
  recording.pressure[4] = std::nan("");
  write_recording(folder_ / "d.h5", recording);
  expect_info("d.h5", {"1.5 to 1.5 kPa", "dead readings     2 of 36"});
}

TEST_F(InfoCommand, ClosesRecordingsOnly) {
  write_recording(folder_ / "u.h5", sample_training("A", 1));
  const std::string before = bytes_of(folder_ / "u.h5");
  expect_named(done({"info", "--close", "u.h5"}), {"touches           1"});
  EXPECT_TRUE(bytes_of(folder_ / "u.h5") == before) << "it is closed already";
  write_map(folder_ / "I.map.h5", sample_map("I"));
  expect_refused({"info", "--close", "I.map.h5"}, {"I.map.h5", "palpate.map", "recording"});
}

TEST_F(InfoCommand, Map) {
  OccupancyGrid map = sample_map("I");
  map.symmetry = 2;
  map.spread_mm = 0.7;
  map.suggested_symmetry = 0;
  write_map(folder_ / "I.map.h5", map);
  expect_info("I.map.h5",
              {"map of I", "65 x 65 of 0.5 mm", "-16.000, -16.000 mm", "0.2000",
               "spread            0.7 mm", "-4.000 to 4.000 nats", "symmetry          2",
               "suggested         full, the symmetry that the map shows"});
}

TEST_F(InfoCommand, Posterior) {
  Posterior posterior;
  posterior.objects = {"A", "I"};
  posterior.lattice.x_mm.count = 2;
  posterior.lattice.y_mm.count = 1;
  posterior.lattice.theta_rad.count = 1;
  posterior.log_likelihood = {-5.0, -7.0, -9.0, -8.0};
  write_posterior(folder_ / "p.h5", posterior);
  expect_info("p.h5", {"posterior over A, I", "2 x 1 x 1", "-5.000 nats at x -5.00 mm",
                       "-8.000 nats at x 5.00 mm"});
}

}  // namespace
}  // namespace palpate
