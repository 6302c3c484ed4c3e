// Links and pictures of the Markdown pages lead to files and headings that exist, and rows stand in
// tables. The site's build knows its own pages only; README.md and bench/ are read elsewhere, too.
// The C++ reference has every public header.

#include <algorithm>
#include <cctype>
#include <regex>
#include <set>

#include <gtest/gtest.h>

#include "document.hpp"

namespace palpate::links_test {

namespace fs = std::filesystem;

/// A page's text without its blocks of code, in which a # begins no heading.
std::string prose_of(const fs::path& page) {
  const std::string text = bytes_of(page);
  std::string prose;
  bool code = false;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin);
    const bool fence = line.starts_with("```");
    code = code != fence;
    if (!code && !fence) {
      prose += line + "\n";
    }
    begin = end + 1;
  }
  return prose;
}

/// The anchors of a page's headings: lower case, blanks become hyphens, punctuation is dropped.
std::set<std::string> anchors_of(const fs::path& page) {
  const std::string prose = prose_of(page);
  const std::regex heading("(^|\n)#+ ([^\n]*)");
  std::set<std::string> anchors;
  for (std::sregex_iterator match(prose.begin(), prose.end(), heading), end; match != end;
       ++match) {
    std::string anchor;
    for (const char c : (*match)[2].str()) {
      if (c == ' ') {
        anchor += '-';
      } else if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_') {
        anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      }
    }
    anchors.insert(anchor);
  }
  return anchors;
}

/// What a page of the site includes is at the page's place, too: bench/SWEEP.md in
/// docs/benchmarks/sweep.md.
fs::path included_by(const fs::path& page) {
  const std::string text = bytes_of(page);
  std::smatch match;
  if (std::regex_search(text, match, std::regex("```\\{include\\} ([^\n]+)"))) {
    return page.parent_path() / match[1].str();
  }
  return page;
}

std::vector<fs::path> pages() {
  const fs::path root = PALPATE_SOURCE_DIR;
  std::vector<fs::path> found{root / "README.md", root / "CHANGELOG.md", root / "CONTRIBUTING.md"};
  for (const char* folder : {"docs", "bench", "examples"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() == ".md") {
        found.push_back(entry.path());
      }
    }
  }
  return found;
}

TEST(Links, LeadToFilesAndHeadings) {
  const std::regex link(R"(\]\(([^)\s]+)\))");
  int count = 0;
  for (const fs::path& page : pages()) {
    const std::string prose = prose_of(page);
    for (std::sregex_iterator match(prose.begin(), prose.end(), link), end; match != end; ++match) {
      const std::string target = (*match)[1];
      if (target.starts_with("http")) {
        continue;
      }
      ++count;
      const std::size_t hash = target.find('#');
      const fs::path file =
          hash == 0 ? page : page.parent_path() / fs::path(target.substr(0, hash));
      ASSERT_TRUE(fs::exists(file)) << page << " links to " << target;
      if (hash != target.npos) {
        EXPECT_TRUE(anchors_of(included_by(file)).contains(target.substr(hash + 1)))
            << page << " links to " << target;
      }
    }
  }
  EXPECT_GT(count, 50) << "the pattern finds the links";
}

TEST(Tables, BeginWithATitle) {
  const std::regex first_row("(?:^|\n)(?!\\|)[^\n]*\n(\\|[^\n]*)\n([^\n]*)");
  const std::regex rule("\\|[ :|-]+\\|");
  int count = 0;
  for (const fs::path& page : pages()) {
    const std::string prose = prose_of(page);
    for (std::sregex_iterator match(prose.begin(), prose.end(), first_row), end; match != end;
         ++match, ++count) {
      EXPECT_TRUE(std::regex_match((*match)[2].str(), rule))
          << page << ": a row outside of a table: " << (*match)[1];
    }
  }
  EXPECT_GT(count, 20) << "the pattern finds the tables";
}

TEST(Reference, HasEveryPublicHeader) {
  const fs::path root = PALPATE_SOURCE_DIR;
  std::string reference;
  for (const auto& page : fs::directory_iterator(root / "docs/api")) {
    reference += bytes_of(page.path());
  }
  for (const char* folder : {"host/include/palpate", "driver/include/palpate"}) {
    for (const auto& header : fs::directory_iterator(root / folder)) {
      const std::string name = header.path().filename();
      if (name == "palpate.hpp" || name == "api.hpp") {
        continue;  // declare nothing of their own
      }
      EXPECT_NE(reference.find("```{doxygenfile} " + name + "\n"), reference.npos)
          << name << " is on no page of docs/api";
    }
  }
}

}  // namespace palpate::links_test
