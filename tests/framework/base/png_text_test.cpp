// SPDX-License-Identifier: Apache-2.0
// Texts in a PNG file of one pixel. The bytes and check sums are those of Python's zlib.
#include <gtest/gtest.h>

#include <marrow/base/png_text.hpp>

#include "tests/harness/message_of.hpp"

namespace png_text_test {

using namespace std::string_literals;

const std::string kBegin = "\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x01\0\0\0\x01\x08\0\0\0\0\x3a\x7e\x9b\x55"s;
const std::string kRest = "\0\0\0\x0aIDATx\xda\x63\x60\x07\0\0\x09\0\x08\x8d\xab\xb9\x01\0\0\0\0IEND\xae\x42\x60\x82"s;
const std::string kText = "\0\0\0\x0ciTXtkey\0\0\0\0\0a\xc3\xa9\n\x9f\x07\x80\x0b"s;  // "aé", and the end of the line

std::string fault_of(const std::string& png, const std::string& keyword = "key") {
  return marrow::test::message_of([&] { (void)marrow::png_text(png, keyword); });
}

std::string with(std::string png, std::size_t at, char byte) {
  png.at(at) = byte;
  return png;
}

TEST(PngText, StandsAfterTheHeaderAndNothingElseChanges) {
  const std::string png = marrow::with_png_text(kBegin + kRest, "key", "aé\n");
  EXPECT_EQ(png, kBegin + kText + kRest);
  EXPECT_EQ(marrow::png_text(png, "key"), "aé\n");
  EXPECT_EQ(marrow::without_png_text(png, "key"), kBegin + kRest);
}

TEST(PngText, ReplacesTheOneOfItsKeywordOnly) {
  const std::string other = marrow::with_png_text(kBegin + kText + kRest, "ke", "other");
  EXPECT_EQ(marrow::png_text(other, "key"), "aé\n");
  EXPECT_EQ(marrow::png_text(other, "ke"), "other");
  const std::string twice = marrow::with_png_text(other, "ke", "aé\n");
  EXPECT_EQ(marrow::png_text(twice, "ke"), "aé\n");
  EXPECT_EQ(marrow::without_png_text(twice, "ke"), kBegin + kText + kRest);
}

TEST(PngText, IsNotThere) {
  EXPECT_EQ(marrow::png_text(kBegin + kRest, "key"), std::nullopt);
  EXPECT_EQ(marrow::png_text(kBegin + kText + kRest, "keyword"), std::nullopt);
  EXPECT_EQ(marrow::png_text(kBegin + kText + kRest, "ke"), std::nullopt);
}

TEST(PngText, SaysWhatIsDamaged) {
  const std::string png = kBegin + kText + kRest;
  const std::size_t text = kBegin.size() + 8;  // the data of the chunk
  EXPECT_EQ(fault_of("GIF89a"), "it is no PNG file");
  EXPECT_EQ(fault_of(png.substr(0, png.size() - 1)), "the PNG file ends too early");
  EXPECT_EQ(fault_of(png.substr(0, text)), "the PNG file ends too early");
  EXPECT_EQ(fault_of(kBegin + "\xff\xff\xff\xffiTXtkey"), "the PNG file ends too early");
  EXPECT_EQ(fault_of(with(png, text + 8, 'b')), "the text of the PNG file was changed: its check sum is another one");
  EXPECT_EQ(fault_of(kBegin + "\0\0\0\x06iTXtkey\0\x01\0\x43\xef\x92\x0e"s + kRest),
            "another program has compressed the text of the PNG file");
  EXPECT_EQ(fault_of(kBegin + "\0\0\0\x06iTXtkey\0\0\0\x5a\xf4\xa3\x4f"s + kRest),
            "the text of the PNG file is not whole");
}

}  // namespace png_text_test
