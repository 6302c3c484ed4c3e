// Who asks for bounds, what bounds refuse, and how --filter auto chooses.

#include <tuple>

#include "bounded_filter.hpp"

namespace palpate::bounded_choice_test {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using Arguments = std::vector<std::string>;

TEST_F(BoundedFilter, IsAskedForByASceneToo) {
  const auto comparable = [](json r) {
    r.erase("seconds");
    return r;
  };
  const json wanted = comparable(bounded());
  scene("filter: bounded\n");
  EXPECT_EQ(comparable(u({"--scene", "scene.yaml"})), wanted);
  EXPECT_FALSE(u({"--scene", "scene.yaml", "--filter", "histogram"}).contains("dropped_mass"));
  EXPECT_FALSE(u({"--scene", "scene.yaml", "--filter", "auto"}).contains("dropped_mass"));
  scene("filter: auto\n");
  EXPECT_FALSE(u({"--scene", "scene.yaml"}).contains("dropped_mass"));
  scene("filter: bounded\nslip_sd: {mm: 1}\n");
  refused({"--scene", "scene.yaml", "--budget-ms", "9"}, {"--budget-ms", "where objects slip"});
  scene("filter: histogram\n");
  refused({"--scene", "scene.yaml", "--tolerance", "0.1"}, {"--tolerance", "has no effect"});
}

TEST_F(BoundedFilter, RefusesFlagsOfParticles) {
  refused({"--filter", "bounded", "--particles", "9"}, {"--particles", "--filter particles"});
}

TEST_F(BoundedFilter, ItsFlagsAreRefusedBesideOtherFilters) {
  for (const char* flag : {"--tolerance=0.1", "--budget-ms=5", "--evidence-nats=1"}) {
    const std::string name = std::string(flag).substr(0, std::string(flag).find('='));
    for (const char* filter : {"histogram", "particles"}) {
      refused({flag, "--filter", filter}, {name + ": has no effect on --filter " + filter,
                                           "use --filter bounded, or leave it out"});
    }
  }
}

TEST_F(BoundedFilter, RefusesValuesOutOfRange) {
  for (const char* value : {"0", "1", "-1e-3", "2", "nan"}) {
    refused({"--tolerance", value}, {"--tolerance", "above 0, below 1"});
  }
  for (const char* flag : {"--budget-ms", "--evidence-nats"}) {
    for (const char* value : {"0", "-1", "nan", "inf"}) {
      refused({std::string(flag) + "=" + value}, {flag, "above 0"});
    }
  }
}

// Two maps: 224 x 224 bins of each are 100,352, more than the rule's 100,000.
TEST_F(BoundedFilter, AutoTakesItForManyBins) {
  const Arguments many{"--bins=224x224x1"};
  const Arguments few{"--bins=223x224x1"};
  EXPECT_THAT(engine(many), AllOf(HasSubstr("filter: bounded, "),
                                  HasSubstr("100352 bins in all, more than 100000")));
  EXPECT_THAT(engine(few), AllOf(HasSubstr("filter: histogram in "),
                                 HasSubstr("99904 bins in all, at most 100000")));
  Arguments slips = many;
  slips.insert(slips.end(), {"--slip-sd-mm", "0.5"});
  EXPECT_THAT(engine(slips), AllOf(HasSubstr("filter: histogram in "),
                                   HasSubstr("objects that slip are followed by the histogram")));
  Arguments written = many;
  written.insert(written.end(), {"--posterior", "p.h5"});
  EXPECT_THAT(engine(written),
              AllOf(HasSubstr("filter: histogram in "), HasSubstr("asked for by --posterior")));
  Arguments explicitly = many;
  explicitly.insert(explicitly.end(), {"--filter", "histogram"});
  EXPECT_THAT(engine(explicitly), HasSubstr("filter: histogram in "));
  Arguments proven = few;
  proven.insert(proven.end(), {"--tolerance", "1e-3", "--budget-ms", "60000"});
  EXPECT_THAT(engine(proven),
              AllOf(HasSubstr("filter: bounded, "), HasSubstr("tolerance 0.001, budget 60000 ms"),
                    HasSubstr("asked for by --tolerance")));
}

TEST_F(BoundedFilter, AutoNamesTheFlagThatKeepsALargeLatticeFromIt) {
  for (const Arguments& flags : {Arguments{"--posterior=p.h5"}, Arguments{"--filter=histogram"}}) {
    const std::string name = flags[0].starts_with("--filter")
                                 ? "--filter histogram"
                                 : flags[0].substr(0, flags[0].find('='));
    Arguments call{"recognize", "u.h5", "--maps", "maps", "--bins=4000x4000x300"};
    call.insert(call.end(), flags.begin(), flags.end());
    expect_refused(call, {"MiB", "or leave out " + name + ": --filter bounded"});
  }
  expect_refused({"recognize", "u.h5", "--maps", "maps", "--bins=4000x4000x300", "--filter=bounded",
                  "--touch-sd-mm=0.5"},
                 {"MiB", "use fewer bins"});
  expect_refused({"recognize", "u.h5", "--maps", "maps", "--bins=4000x4000x300",
                  "--filter=histogram", "--posterior=p.h5"},
                 {"leave out --posterior and --filter histogram"});
}

TEST_F(BoundedFilter, IsRefusedWhereTheMachineHasNoRoomForIt) {
  const auto with_filter = [](const std::string& filter, Arguments flags) {
    flags.insert(flags.begin(), {"recognize", "u.h5", "--maps", "maps", "--filter=" + filter});
    return flags;
  };
  const Arguments fine{"--bins=2000000000x2000000000x1"};
  const Arguments turning{"--bins=4x4x2000000000"};
  const Arguments wide{"--bins=1000x1000x1000", "--x-mm=-1e9:1e9", "--y-mm=-1e9:1e9"};
  const Arguments dense{"--bins=300000x300000x2"};
  const Arguments absurd{"--bins=2000000000x2000000000x2000000000"};
  expect_refused(with_filter("bounded", fine), {"lattice", "too many", "use fewer bins"});
  expect_refused(with_filter("bounded", dense), {"lattice", "fewer bins along x and y"});
  expect_refused(with_filter("bounded", turning), {"lattice", "MiB", "fewer thetas"});
  expect_refused(with_filter("bounded", wide), {"lattice", "MiB", "narrow the region"});
  expect_refused(with_filter("bounded", absurd), {"lattice", "use fewer bins"});
  // Nothing to ask for: bounds would refuse as well.
  for (const Arguments& flags : {fine, turning, dense, absurd}) {
    const Outcome outcome = palpate(with_filter("histogram", flags));
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, Not(HasSubstr("bounded")));
  }
}

}  // namespace palpate::bounded_choice_test
