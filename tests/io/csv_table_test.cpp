#include "io/csv_table.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "file_parts.hpp"

namespace palpate::csv_table_test {

using Rows = std::vector<std::vector<std::optional<double>>>;

class Csv : public OneFile {
 protected:
  Csv() : OneFile("log.csv") {}

  CsvTable table(const std::string& text) const {
    put_bytes(path_, text);
    return CsvTable(path_);
  }

  static Rows rows_of(CsvTable table) {
    Rows rows;
    while (table.next()) {
      rows.emplace_back();
      for (std::size_t i = 0; i < table.columns().size(); ++i) {
        rows.back().push_back(table.number(i));
      }
    }
    return rows;
  }
  Rows rows_of(const std::string& text) const { return rows_of(table(text)); }

  // What reading all of the table says.
  std::string message(const std::string& text) const {
    return input_error([&] { rows_of(text); });
  }
};

const Rows two_by_two{{1.5, -2.0}, {3e-3, 4.0}};

TEST_F(Csv, SeparatorsLineEndsAndDecorationsMakeNoDifference) {
  for (const char* text :
       {"a,b\n1.5,-2\n3e-3,4\n", "a,b\r\n1.5,-2\r\n3e-3,4",
        "\xEF\xBB\xBF\"a\",\"b\"\n1.5,\"-2\"\n\n3e-3,+4\n",
        "# made by hand\n a , b \n1.5, -2 # first\n\n  # second\n3e-3,4\n", "a;b\n1,5;-2\n3e-3;4\n",
        "a;b\n1.5;-2\n3e-3;4\n", "a\tb\n1,5\t-2\n3e-3\t4\n", "a b\n1.5   -2\n  3e-3 4  \n",
        "a,b,\n1.5,-2,\n3e-3,4,\n"}) {
    EXPECT_EQ(rows_of(text), two_by_two) << text;
    EXPECT_EQ(table(text).columns(), (std::vector<std::string>{"a", "b"})) << text;
  }
}

TEST_F(Csv, NumbersAloneHaveNoHeader) {
  const CsvTable plain = table("1.5,-2\n3e-3,4\n");
  EXPECT_FALSE(plain.has_header());
  EXPECT_EQ(plain.columns(), (std::vector<std::string>{"1", "2"}));
  EXPECT_EQ(rows_of("1.5,-2\n3e-3,4\n"), two_by_two);
}

// pandas.DataFrame(array).to_csv() writes such names, after an empty one for the index.
TEST_F(Csv, CountedColumnsAreAHeader) {
  EXPECT_EQ(rows_of("0,1,2,3,4\n5,6,7,8,9\n"), (Rows{{5.0, 6.0, 7.0, 8.0, 9.0}}));
  for (const char* first : {"", "time"}) {
    EXPECT_EQ(rows_of(std::string(first) + ",0,1,2,3,4\n0,5,6,7,8,9\n"),
              (Rows{{0.0, 5.0, 6.0, 7.0, 8.0, 9.0}}));
  }
  EXPECT_EQ(rows_of("0,1,2,3,5\n5,6,7,8,9\n").size(), 2u);
  EXPECT_EQ(rows_of("0,1,2,3\n5,6,7,8\n").size(), 2u) << "it may be a pose";
}

// A bad cell must not make a header of a row of data.
TEST_F(Csv, AHeaderHoldsNoNumber) {
  for (const auto& [row, said] : {std::pair{"inf,1,2,3", "column '1': 'inf'"},
                                  {"1,2,3,NA", "column '4': 'NA'"},
                                  {"1e999,a,b,c", "column '1': '1e999'"},
                                  {"nan,a,b,c", "column '2': 'a'"},
                                  {"-inf;1,5;2;3", "column '1': '-inf'"},
                                  {"time,0,1,3", "column '1': 'time'"},
                                  {"0,1,2,NA", "column '4': 'NA'"}}) {
    expect_named(message(row), {":1: ", said, "in a header, no cell is a number"});
  }
  for (const char* row : {"a,b,c,d", ",a,b,c", "a,,infra,nano", "a,1st,0x1,e5"}) {
    EXPECT_TRUE(table(std::string(row) + "\n1,2,3,4\n").has_header()) << row;
  }
}

TEST_F(Csv, EmptyCellsAndNanAreNoNumbers) {
  const Rows expected{{1.0, {}, {}}, {{}, {}, 2.0}};
  EXPECT_EQ(rows_of("a,b,c\n1,,\n,nan,2\n"), expected);
  EXPECT_EQ(rows_of("a;b;c\n1;;NaN\n;\"\";2\n"), expected);
}

TEST_F(Csv, NamesAreFoundInAnyCase) {
  const CsvTable named = table("Time,\"p, 0\",P1\n1,2,3\n");
  EXPECT_EQ(named.find("time"), 0u);
  EXPECT_EQ(named.find("p, 0"), 1u);
  EXPECT_EQ(named.find("p1"), 2u);
  EXPECT_EQ(named.find("p2"), std::nullopt);
  EXPECT_EQ(table("T,t\n1,2\n").find("t"), 1u) << "the same case comes first";
}

TEST_F(Csv, ErrorsNameLineAndColumn) {
  // After a comment, so that the last is line 4
  for (const auto& [rows, named] :
       {std::pair{"a,b\n1,2\n3,abc\n", "column 'b': 'abc' is not a finite"},
        {"a,b\n1,2\n3,inf\n", "column 'b': 'inf'"},
        {"9,8\n1,2\n3,0x1\n", "column '2': '0x1'"},
        {"a,b\n1,2\n3\n", "1 cells, the first row 2"},
        {"a,b\n1,2\n3,4,5\n", "3 cells"},
        {"a,b\n1,2\n3,1.234,5\n", "3 cells"},
        {"a,b\n1,2\n3,\"4\n", "quote is not closed"},
        {"a,b\n1,2\n3,\"4\"5\n", "follows a closing quote"},
        {"a;b\n1;2\n3;1.234,5\n", "'1.234,5'"}}) {
    const std::string said = message("# c\n" + std::string(rows));
    EXPECT_TRUE(said.starts_with(path_.string() + ":4: ")) << said;
    expect_named(said, {named});
  }
}

TEST_F(Csv, FilesThatHoldNoTable) {
  for (const auto& [text, named] :
       {std::pair<std::string, const char*>{"", "log.csv: holds no row"},
        {"# nothing\n\n", "holds no row"},
        {"a,a\n1,2\n", ":1: two columns are called 'a'"},
        {std::string("a,b\n\0", 5), "is no text"},
        {std::string((17 << 20) + 1, '1'), "line 1"}}) {
    expect_named(message(text), {named});
  }
  expect_named(input_error([&] { CsvTable(folder_ / "none.csv"); }), {"none.csv", "no such file"});
}

// Rows lie across the blocks in which the file is read.
TEST_F(Csv, LongTablesAreReadWhole) {
  std::string text = "a,b\n";
  for (int i = 0; i < 300'000; ++i) {
    text += std::to_string(i) + ",0.5\n";
  }
  CsvTable large = table(text);
  EXPECT_EQ(large.count_lines(), 300'001u);
  double sum = 0.0;
  while (large.next()) {
    sum += large.require_number(0) + large.require_number(1);
  }
  EXPECT_EQ(sum, 300'000.0 * 299'999.0 / 2.0 + 150'000.0);
}

}  // namespace palpate::csv_table_test
