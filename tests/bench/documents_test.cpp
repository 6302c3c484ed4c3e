// What README.md and bench/*.md say in words and short tables is what the tables that the program
// printed say, rounded.

#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace palpate::documents_test {

std::vector<std::string> lines_of(const std::string& file) {
  std::ifstream stream(std::string(PALPATE_SOURCE_DIR "/") + file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
  }
  EXPECT_FALSE(lines.empty()) << file;
  return lines;
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(' ');
  return begin == text.npos ? "" : text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

/// The cells of a row "| a | b |".
std::vector<std::string> cells_of(const std::string& row) {
  std::vector<std::string> cells;
  std::istringstream stream(row);
  std::string cell;
  std::getline(stream, cell, '|');
  while (std::getline(stream, cell, '|')) {
    cells.push_back(trimmed(cell));
  }
  return cells;
}

/// Values of the table that `palpate-bench kernels` printed, by case and what was measured.
std::map<std::pair<std::string, std::string>, double> kernels_table() {
  std::map<std::pair<std::string, std::string>, double> values;
  for (const std::string& line : lines_of("bench/RESULTS.md")) {
    const auto cells = cells_of(line);
    double value = 0.0;
    if (cells.size() == 5 && std::istringstream(cells[2]) >> value) {
      values[{cells[0], cells[1]}] = value;
    }
  }
  return values;
}

/// A figure that the line with these words quotes.
struct Quoted {
  const char* file;
  const char* line;
  const char* name;
  const char* measured;
  const char* form;
};

constexpr const char* readme = "README.md";
constexpr const char* results = "bench/RESULTS.md";
constexpr const char* fine = "likelihood 200x200x250";
constexpr const char* middle = "likelihood 100x100x100";
constexpr const char* coarse = "likelihood 25x25x16";
constexpr const char* per_bin = "per bin, element and touch";

const Quoted quoted[] = {
    {readme, "| log-likelihood against", "accuracy 100x100x1", "largest error at touch 1",
     " {:.1e} nats per touch"},
    {readme, "| log-likelihood against", "accuracy 100x100x1", "largest error at touch 1000",
     " {:.1e} after 1,000"},
    {results, "| likelihood 200x200x250 ≤", fine, per_bin, " {:.2f} ns |"},
    {results, "| likelihood 100x100x100 ≤", middle, per_bin, " {:.2f} ns |"},
    {results, "| coarse lattice, 25x25x16", coarse, per_bin, " {:.2f} ns |"},
    {results, "| error ≤ 1e-4 nats per touch", "accuracy 100x100x1", "largest error at touch 1",
     " {:.1e} |"},
    {results, "| error ≤ 1e-3 nats after 50", "accuracy 100x100x1", "largest error at touch 50",
     " {:.1e} |"},
    {results, "| error ≤ 1e-2 nats after 1,000", "accuracy 100x100x1",
     "largest error at touch 1000", " {:.1e} |"},
    {results, "| ≤ 10 B per bin", fine, "device memory", " {:.2f} B |"},
    {results, "| identity and mode of 50", "reductions 200x200x250", "identity and mode",
     " {:.0f} ms |"},
    {results, "| with all marginals", "reductions 200x200x250", "identity, mode and all marginals",
     " {:.0f} ms |"},
    {results, "| five maps of 192", "maps at 0.1 mm", "all maps", " {:.3f} s, "},
    {results, "| five maps of 192", "maps at 0.1 mm", "largest error", " {:.1e} nats |"},
    {results, "| a relative 1e-4", "map stream of one spot", "largest relative error", " {:.1e} |"},
    {results, "| many unknowns: ≤ 10 %", "many unknowns", "lost against the large case",
     " {:.1f} % |"},
    {results, "| many unknowns: ≥ 4", "many unknowns", "rate over a process per unknown",
     " {:.1f} times |"},
    {results, "| many unknowns: ≥ 1,000 per s", "many unknowns", "palpate batch by bounds",
     " {:.0f} per s |"},
    {results, "| one touch of 5 x 10,000", "latency 25x25x16", "touch to estimate, median",
     " {:.1f} ms, "},
    {results, "| one touch of 5 x 10,000", "latency 25x25x16", "device, by its clock",
     " {:.1f} on the device"},
    {results, "times as long: it blends", fine, "CPU loop's time over this", "  {:.2f} to "},
    {results, "times as long: it blends", coarse, "CPU loop's time over this", " to {:.2f} times"},
};

TEST(Documents, QuoteTheKernelsTableAsItIs) {
  const auto table = kernels_table();
  for (const Quoted& quote : quoted) {
    SCOPED_TRACE(std::string(quote.file) + ": " + quote.line);
    const auto value = table.find({quote.name, quote.measured});
    ASSERT_NE(value, table.end()) << quote.name << ", " << quote.measured;
    const std::string figure = fmt::format(fmt::runtime(quote.form), value->second);
    int found = 0;
    for (const std::string& line : lines_of(quote.file)) {
      if (line.find(quote.line) != line.npos) {
        ++found;
        EXPECT_NE(line.find(figure), line.npos) << "'" << figure << "' is not in: " << line;
      }
    }
    EXPECT_EQ(found, 1) << "lines";
  }
}

}  // namespace palpate::documents_test
