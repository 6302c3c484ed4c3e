// Records of a wrong type: named before a page shows anything.

#include "cli/page/viewed_files.hpp"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/scratch_folder.hpp"

namespace palpate::viewed_files_test {

class ViewedFiles : public testing::Test {
 protected:
  /// A file of one record: E for certain, and these fields.
  std::string file_of(const std::string& fields) const {
    put_bytes(folder_ / "record.json",
              R"({"best": "E", "identity": {"E": 1.0}, )" + fields + "}\n");
    return folder_ / "record.json";
  }

  ScratchFolder folder_;
};

TEST_F(ViewedFiles, FieldsOfAWrongTypeAreNamed) {
  const std::pair<const char*, const char*> cases[] = {
      {R"("recording": 7)", "field 'recording' is 7, not a name"},
      {R"("touches": "x")", "field 'touches' is string, not a whole number from 0"},
      {R"("touches": -1)", "field 'touches' is -1, not a whole number from 0"},
      {R"("touches": 1e300)", "field 'touches' is 1e+300, not a whole number from 0"},
      {R"("touches": 1000000001)", "field 'touches' is 1000000001, not"},
      {R"("error": 5)", "field 'error' is 5, not a sentence"},
      {R"("unknown": "x", "touch": 0)", "field 'unknown' is string, not a whole number"},
      {R"("unknown": 0, "touch": 0.5)", "field 'touch' is 0.5, not a whole number"},
      {R"("mode": 3)", "field 'mode' is number, not an object"},
      {R"("mode": {"map": 5})", "field 'mode.map' is 5, not a file"},
      {R"("mode": {"map": "E.h5", "mirrored": "no"})", "field 'mode.mirrored' is string, not true"},
      {R"("fit": {"verdict": {}})", "field 'fit.verdict' is object, not a word"},
      {R"("decision": {"act": "yes"})", "field 'decision.act' is string, not true or false"},
  };
  for (const auto& [fields, words] : cases) {
    const std::string path = file_of(fields);
    const std::string said = input_error([&] { cli::ViewedFiles(std::vector{path}); });
    EXPECT_TRUE(said.starts_with(path + ": record 0: " + words)) << said;
  }
}

TEST_F(ViewedFiles, FieldsThatAreNullAreMissing) {
  const std::string path = file_of(
      R"("recording": null, "touches": null, "error": null, "unknown": null, "touch": 0,
         "mode": {"map": null, "mirrored": null}, "fit": null, "decision": {"act": null})");
  const cli::ViewedFiles files(std::vector{path});
  EXPECT_EQ(files.get("/file/0"),
            R"({"kind":"records","rows":[["",0,"E",1.0,null,null,null,null]]})"
            "\n");
  EXPECT_TRUE(files.get("/file/0/record/0"));
  EXPECT_FALSE(files.get("/file/0/map/0"));
}

TEST_F(ViewedFiles, RecordsNestWithinReason) {
  const auto nested = [](std::size_t levels) {
    return R"("x": )" + std::string(levels, '[') + std::string(levels, ']');
  };
  EXPECT_TRUE(cli::ViewedFiles(std::vector{file_of(nested(62))}).get("/file/0/record/0"));
  for (const std::size_t levels : {65, 200'000}) {
    const std::string path = file_of(nested(levels));
    expect_named(input_error([&] { cli::ViewedFiles(std::vector{path}); }),
                 {"record 0 is nested more than 64 deep"});
  }
}

}  // namespace palpate::viewed_files_test
