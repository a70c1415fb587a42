// SPDX-License-Identifier: Apache-2.0
// Texts of other systems. The bytes of UTF-16 are those of Python's encode("utf-16-le") and its like.
#include "marrow/base/plain_text.hpp"

#include <gtest/gtest.h>

namespace plain_text_test {

using marrow::plain_text;

TEST(PlainText, LineEnds) {
  EXPECT_EQ(plain_text("a\nb\n"), "a\nb\n");
  EXPECT_EQ(plain_text("a\r\nb\r\n"), "a\nb\n");
  EXPECT_EQ(plain_text("a\rb\r"), "a\nb\n");
  EXPECT_EQ(plain_text("a\r\r\nb\r\n\r"), "a\nb\n");
  EXPECT_EQ(plain_text("a\r,b\nc"), "a\r,b\nc") << "beside line feeds it is no line end";
  EXPECT_EQ(plain_text(""), "");
}

TEST(PlainText, MarksAndUtf16) {
  EXPECT_EQ(plain_text("\xEF\xBB\xBFgr\xC3\xB6\xC3\x9F"
                       "er"),
            "gr\xC3\xB6\xC3\x9F"
            "er");
  EXPECT_EQ(plain_text(std::string("\xFF\xFE\xF6\0\r\0\n\0\x34\xD8\x1E\xDD", 12)), "\xC3\xB6\n\xF0\x9D\x84\x9E");
  EXPECT_EQ(plain_text(std::string("\xFE\xFF\0\xF6\0\r\xD8\x34\xDD\x1E", 10)), "\xC3\xB6\n\xF0\x9D\x84\x9E");
  EXPECT_EQ(plain_text(std::string("\xFE\xFF\xD8\x34\0a\0", 7)),
            "\xEF\xBF\xBD"
            "a\xEF\xBF\xBD")
      << "halves of characters";
  EXPECT_TRUE(marrow::begins_as_utf16("\xFF\xFE"));
  EXPECT_FALSE(marrow::begins_as_utf16("\xFF"));
}

}  // namespace plain_text_test
