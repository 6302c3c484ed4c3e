#include "document.hpp"

#include <cstdlib>

namespace palpate {
namespace {

/// All blocks of shell commands of a document, in their order.
std::string commands_in(const std::string& document) {
  const std::string opening = "```sh\n";
  std::string commands;
  for (auto begin = document.find(opening); begin != document.npos;) {
    begin += opening.size();
    const auto end = document.find("```", begin);
    commands += document.substr(begin, end - begin);
    begin = document.find(opening, end);
  }
  return commands;
}

}  // namespace

std::string source_text(const std::string& path) { return bytes_of(PALPATE_SOURCE_DIR "/" + path); }

Said DocumentTest::run(const std::string& page) const {
  const std::string commands = commands_in(source_text("docs/" + page));
  EXPECT_NE(commands, "") << page << " has no commands";
  put_bytes(folder_ / "commands.sh", commands);
  const std::filesystem::path program = PALPATE_PROGRAM;
  std::string environment = "PATH='" + program.parent_path().string() + "':";
#ifdef PALPATE_PYTHON
  const std::filesystem::path python = PALPATE_PYTHON;
  environment += "'" + python.parent_path().string() + "':";
  environment = "PYTHONDONTWRITEBYTECODE=1 PYTHONPATH='" PALPATE_MODULE "' " + environment;
#endif
  const std::string line = "cd '" + folder_.path().string() + "' && " + environment +
                           "\"$PATH\" bash -euo pipefail commands.sh > said 2> complained";
  Said said;
  EXPECT_EQ(std::system(line.c_str()), 0) << bytes_of(folder_ / "complained");
  said.out = bytes_of(folder_ / "said");
  said.err = bytes_of(folder_ / "complained");
  return said;
}

nlohmann::json DocumentTest::json(const std::string& file) const {
  return nlohmann::json::parse(bytes_of(folder_ / file));
}

nlohmann::json DocumentTest::scores(const std::string& results) const {
  return nlohmann::json::parse(done({"evaluate", results, "--json", "-"}));
}

void DocumentTest::expect_written(const std::vector<std::string>& names) const {
  for (const std::string& name : names) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
  }
}

void DocumentTest::expect_quoted(const std::string& page, const std::string& printed,
                                 std::initializer_list<const char*> lines) {
  expect_named(source_text("docs/" + page), lines);
  expect_named(printed, lines);
}

}  // namespace palpate
