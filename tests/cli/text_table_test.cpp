#include "cli/text_table.hpp"

#include <gtest/gtest.h>

namespace palpate::cli::text_table_test {

TEST(ShortenMiddle, KeepsBothEndsOfALongName) {
  EXPECT_EQ(shorten_middle("mug.h5", 6), "mug.h5");
  EXPECT_EQ(shorten_middle("left-hand-mug-000123.h5", 12), "left-...3.h5");
  EXPECT_EQ(shorten_middle("left-hand-mug-000123.h5", 11), "left...3.h5");
  EXPECT_EQ(shorten_middle("left", 3), "lef");
  EXPECT_EQ(shorten_middle("left", 0), "");
}

TEST(ShortenMiddle, CountsCharactersNotBytes) {
  EXPECT_EQ(shorten_middle("äöüäöü", 6), "äöüäöü");
  EXPECT_EQ(shorten_middle("äöüäöüäöü", 7), "äö...öü");
}

TextTable sample() {
  TextTable table({{"recording", false, true}, {"mm", true}, {"nothing"}, {"best", false, true}});
  table.add({"a-recording-of-a-long-name.h5", "-1.25", "", "a-label-of-many-letters"});
  table.add({"b.h5", "10.50", "", "B"});
  return table;
}

TEST(TextTable, IsAsWideAsItsContentAndLeavesOutWhatIsEmpty) {
  EXPECT_EQ(sample().text({}),
            "recording                         mm  best\n"
            "a-recording-of-a-long-name.h5  -1.25  a-label-of-many-letters\n"
            "b.h5                           10.50  B\n");
  EXPECT_EQ(sample().text(61), sample().text({})) << "it fits as it is";
}

TEST(TextTable, GivesUpBlanksThenNamesWhereTheTerminalIsNarrow) {
  EXPECT_EQ(sample().text(60),
            "recording                        mm best\n"
            "a-recording-of-a-long-name.h5 -1.25 a-label-of-many-letters\n"
            "b.h5                          10.50 B\n");
  EXPECT_EQ(sample().text(40),
            "recording     mm best\n"
            "a-re....h5 -1.25 a-label-of-many-letters\n"
            "b.h5       10.50 B\n");
}

TEST(TextTable, NoLineIsWiderThanTheTerminalAsLongAsNamesCanGiveWay) {
  for (int columns = 9 + 1 + 5 + 1 + 8; columns < 80; ++columns) {
    const std::string text = sample().text(columns);
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = text.find('\n', begin);
      EXPECT_LE(end - begin, static_cast<std::size_t>(columns)) << text;
      begin = end + 1;
    }
    EXPECT_NE(text.find("-1.25 "), std::string::npos) << "numbers are never cut";
  }
  EXPECT_EQ(sample().text(1), sample().text(24)) << "shorter names could not be told apart";
}

// Numbers keep their headings, and columns of a rank stay together.
TEST(TextTable, PutsBelowItsRowWhatHasNoRoomThere) {
  TextTable table(
      {{"name"}, {"n", true, false, 2}, {"x", true, false, 3}, {"fit", false, false, 1}});
  table.add({"mug", "12", "1.25", "fits"});
  table.add({"pen", "", "10.50", "-"});
  EXPECT_EQ(table.text(19),
            "name  n     x fit\n"
            "mug  12  1.25 fits\n"
            "pen     10.50 -\n");
  EXPECT_EQ(table.text(17),
            "name  n     x\n"
            "mug  12  1.25\n"
            "    fits\n"
            "pen     10.50\n");
  EXPECT_EQ(table.text(10),
            "name     x\n"
            "mug   1.25\n"
            "    n 12, fits\n"
            "pen  10.50\n");
  EXPECT_EQ(table.text(9),
            "name\n"
            "mug\n"
            "    n 12, x 1.25, fits\n"
            "pen\n"
            "    x 10.50\n");
}

TEST(TextTable, ShowsNoControlCharacter) {
  TextTable table({{"name"}});
  table.add({"a\033[2J\nb"});
  EXPECT_EQ(table.text({}), "name\na?[2J?b\n");
}

}  // namespace palpate::cli::text_table_test
