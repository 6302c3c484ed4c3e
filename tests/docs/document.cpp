#include "document.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <sstream>

namespace palpate {
namespace {

using Words = std::vector<std::string>;

constexpr char end_of_block = '\x1e';

/// A block of shell commands of a page, and the lines below it that quote what it prints.
struct Block {
  std::string commands;
  std::vector<std::string> quoted;
};

std::vector<std::string> lines_of(const std::string& text, char end = '\n') {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line, end);) {
    lines.push_back(line);
  }
  return lines;
}

/// The blocks ```sh of a document, in their order. Fences without a language quote the last one.
std::vector<Block> blocks_in(const std::string& document) {
  std::vector<Block> blocks;
  std::string fence;
  bool inside = false;
  for (const std::string& line : lines_of(document)) {
    if (line.starts_with("```")) {
      inside = !inside;
      fence = line;
      if (inside && line == "```sh") {
        blocks.emplace_back();
      }
    } else if (inside && fence == "```sh") {
      blocks.back().commands += line + "\n";
    } else if (inside && fence == "```" && !blocks.empty()) {
      blocks.back().quoted.push_back(line);
    }
  }
  return blocks;
}

/// The words of a line; a coordinate and its standard deviation are two.
Words words_of(std::string line) {
  for (auto at = line.find("+-"); at != line.npos; at = line.find("+-", at)) {
    line.replace(at, 2, " ");
  }
  // How long it took is never the same.
  if (line.find("per second") != line.npos) {
    std::erase_if(line, [](char c) { return (c >= '0' && c <= '9') || c == '.'; });
  }
  std::istringstream stream(line);
  Words words{std::istream_iterator<std::string>(stream), std::istream_iterator<std::string>()};
  // Dropped mass has one digit, and is at most 1e-4.
  std::erase_if(words, [](const std::string& word) {
    return word == "dropped" || word == "0.0001" ||
           (word.size() == 5 && word.substr(1, 3) == "e-0");
  });
  return words;
}

/// Equal, but that the last digit of numbers with a point may be one off: on another machine,
/// float32 rounds elsewhere.
bool agree(const std::string& quoted, const std::string& printed) {
  char* quoted_rest = nullptr;
  char* printed_rest = nullptr;
  const double a = std::strtod(quoted.c_str(), &quoted_rest);
  const double b = std::strtod(printed.c_str(), &printed_rest);
  const std::string_view number(quoted.c_str(), quoted_rest);
  const std::size_t point = number.find('.');
  return quoted == printed ||
         (point != number.npos && std::string_view(quoted_rest) == printed_rest &&
          std::abs(a - b) < 1.5 * std::pow(10.0, -static_cast<double>(number.size() - point - 1)));
}

/// Whether a line has these words, in their order: a quotation may leave columns of a table out.
bool holds(const Words& printed, const Words& quoted) {
  auto at = printed.begin();
  return std::ranges::all_of(quoted, [&](const std::string& word) {
    at = std::find_if(at, printed.end(),
                      [&](const std::string& other) { return agree(word, other); });
    return at != printed.end() && at++ != printed.end();
  });
}

void expect_printed(const std::vector<std::string>& quoted, const std::string& printed) {
  std::vector<Words> lines;
  std::ranges::transform(lines_of(printed), std::back_inserter(lines), words_of);
  for (const std::string& line : quoted) {
    const Words words = words_of(line);
    EXPECT_TRUE(line == "..." ||
                std::ranges::any_of(lines, [&](const Words& other) { return holds(other, words); }))
        << "the commands above it do not print: " << line << "\nbut:\n"
        << printed;
  }
}

}  // namespace

std::string source_text(const std::string& path) { return bytes_of(PALPATE_SOURCE_DIR "/" + path); }

Said DocumentTest::run(const std::string& page) const {
  const std::vector<Block> blocks = blocks_in(source_text("docs/" + page));
  EXPECT_FALSE(blocks.empty()) << page << " has no commands";
  std::string commands;
  for (const Block& block : blocks) {
    commands += block.commands + "printf '\\x1e'; printf '\\x1e' >&2\n";
  }
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
  const std::vector<std::string> out = lines_of(said.out, end_of_block);
  const std::vector<std::string> err = lines_of(said.err, end_of_block);
  for (std::size_t i = 0; i < std::min({blocks.size(), out.size(), err.size()}); ++i) {
    expect_printed(blocks[i].quoted, out[i] + err[i]);
  }
  std::erase(said.out, end_of_block);
  std::erase(said.err, end_of_block);
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

}  // namespace palpate
