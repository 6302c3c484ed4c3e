#include "model/option_words.hpp"

#include <gtest/gtest.h>

namespace palpate::option_words_test {

TEST(OptionWords, EachFaceSaysAnOptionInItsOwnWords) {
  const char* const message =
      "give `bins 25x25x16`, `x-mm=-5.5:5` or `filter bounded`; not `prior`";
  EXPECT_EQ(in_flags(message),
            "give --bins 25x25x16, --x-mm=-5.5:5 or --filter bounded; not --prior");
  EXPECT_EQ(in_keywords(message),
            "give bins=(25, 25, 16), x_mm=(-5.5, 5) or filter='bounded'; not prior=");
  EXPECT_EQ(in_keywords("`gamma 1.5`: must be below 1"), "gamma=1.5: must be below 1");
  EXPECT_EQ(in_keywords("`pivot-mm`: missing"), "pivot_mm: missing");
  EXPECT_EQ(in_keywords("`order x`: give rows"), "order='x': give rows") << "no list of numbers";
}

TEST(OptionWords, OtherTextBetweenBackticksStays) {
  for (const char* const text : {"", "`", "``", "`A.h5`", "a `B`", "`/tmp/a b`: no such file"}) {
    EXPECT_EQ(in_flags(text), text);
    EXPECT_EQ(in_keywords(text), text);
  }
}

}  // namespace palpate::option_words_test
