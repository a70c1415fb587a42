// SPDX-License-Identifier: Apache-2.0
#include "plain_letters.hpp"

#include <sstream>
#include <string_view>
#include <vector>

namespace marrow::draw {
namespace {

constexpr char32_t kFirstLetter = 0xC0, kLastLetter = 0x17F, kNoLetter = 0xFFFD;

/// U+00C0 to U+017F without their marks, by Unicode's decompositions; those without one as they are usually written.
constexpr const char* kLetters =
    "A A A A A A AE C E E E E I I I I D N O O O O O x O U U U U Y Th ss "
    "a a a a a a ae c e e e e i i i i d n o o o o o / o u u u u y th y "
    "A a A a A a C c C c C c C c D d D d E e E e E e E e E e G g G g "
    "G g G g H h H h I i I i I i I i I i IJ ij J j K k k L l L l L l L "
    "l L l N n N n N n 'n N n O o O o O o OE oe R r R r R r S s S s S s "
    "S s T t T t T t U u U u U u U u U u U u W w Y y Y Z z Z z Z z s";

constexpr struct {
  char32_t sign;
  const char* plain;
} kSigns[] = {{0xA0, " "},   {0xB0, " deg"}, {0xB1, "+-"},   {0xB2, "2"},    {0xB3, "3"},
              {0xB5, "u"},   {0x3BC, "u"},   {0x2013, "-"},  {0x2014, "-"},  {0x2018, "'"},
              {0x2019, "'"}, {0x201C, "\""}, {0x201D, "\""}, {0x2026, "..."}};

std::vector<std::string> split(const char* words) {
  std::istringstream stream(words);
  std::vector<std::string> all;
  for (std::string word; stream >> word;) all.push_back(word);
  return all;
}

std::string in_ascii(char32_t letter) {
  static const std::vector<std::string> kPlain = split(kLetters);
  if (letter < 0x80) return std::string(1, char(letter));
  if (letter >= kFirstLetter && letter <= kLastLetter) return kPlain.at(letter - kFirstLetter);
  if (letter >= 0x300 && letter <= 0x36F) return "";  // a mark on the letter before it
  for (const auto& [sign, plain] : kSigns)
    if (sign == letter) return plain;
  return "?";
}

}  // namespace

std::string in_plain_letters(const std::string& text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const bool is_stray = lead >= 0x80 && lead < 0xC0;
    const int more = lead < 0xC0 ? 0 : lead < 0xE0 ? 1 : lead < 0xF0 ? 2 : 3;
    char32_t letter = is_stray ? kNoLetter : more == 0 ? lead : lead & (0x3F >> more);
    ++i;
    for (int k = 0; k < more && i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0) == 0x80; ++k, ++i)
      letter = letter << 6 | (static_cast<unsigned char>(text[i]) & 0x3F);
    plain += in_ascii(letter);
  }
  return plain;
}

}  // namespace marrow::draw
