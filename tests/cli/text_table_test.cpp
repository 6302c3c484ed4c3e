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
  TextTable table({{"recording"}, {"mm", true}, {"nothing"}, {"best"}});
  table.add({"a-recording-of-a-long-name.h5", "-1.25", "", "a-label-of-many-letters"});
  table.add({"b.h5", "10.50", "", "B"});
  return table;
}

TEST(TextTable, IsAsWideAsItsContentAndLeavesOutWhatIsEmpty) {
  EXPECT_EQ(sample().text(),
            "recording                         mm  best\n"
            "a-recording-of-a-long-name.h5  -1.25  a-label-of-many-letters\n"
            "b.h5                           10.50  B\n");
}

TEST(TextTable, ShowsNoControlCharacter) {
  TextTable table({{"name"}});
  table.add({"a\033[2J\nb"});
  EXPECT_EQ(table.text(), "name\na?[2J?b\n");
}

}  // namespace palpate::cli::text_table_test
