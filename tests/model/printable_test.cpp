#include <string>

#include <gtest/gtest.h>

#include "model/option_words.hpp"
#include "model/printable.hpp"

namespace palpate::printable_test {

TEST(Printable, KeepsWellFormedTextAndReplacesControlCharacters) {
  for (const char* text : {"", "A.unknown.h5", "Schlüssel", "€", "−10 ≤ θ", "鍵", "🔑"}) {
    EXPECT_EQ(printable(text), text);
  }
  EXPECT_EQ(printable("a\nb\tc\x7F"), "a?b?c?");
  EXPECT_EQ(printable("\xC2\x85"), "??");  // next line, U+0085
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a?b");
}

TEST(Printable, ReplacesEveryByteOfWhatIsNotUtf8) {
  EXPECT_EQ(printable("\xFF"), "?");
  EXPECT_EQ(printable("\x80z"), "?z");
  EXPECT_EQ(printable("\xC3("), "?(");
  EXPECT_EQ(printable("x\xE2\x82"), "x??");               // the end is missing
  EXPECT_EQ(printable("\xC0\xAF"), "??");                 // '/' in two bytes
  EXPECT_EQ(printable("\xE0\x80\xAF"), "???");            // '/' in three bytes
  EXPECT_EQ(printable("\xED\xA0\x80"), "???");            // a surrogate
  EXPECT_EQ(printable("\xF4\x90\x80\x80"), "????");       // beyond U+10FFFF
  EXPECT_EQ(printable("\xF8\x88\x80\x80\x80"), "?????");  // five bytes
}

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

TEST(OptionWords, MayBeVeryLong) {
  const std::string megabyte(1 << 20, 'a');
  EXPECT_EQ(in_flags("`sensor " + megabyte + "`: no such file"),
            "--sensor " + megabyte + ": no such file");
  EXPECT_EQ(in_keywords("`sensor " + megabyte + "`"), "sensor='" + megabyte + "'");
  EXPECT_EQ(in_flags("`" + megabyte + "`"), "--" + megabyte);
}

}  // namespace palpate::printable_test
