// SPDX-License-Identifier: Apache-2.0
#pragma once
// Inputs made from others, and the words that are put into them.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace marrow::fuzz {

/// Numbers in digits that are often at the border of a range.
inline const std::vector<std::string>& digits() {
  static const std::vector<std::string> all = [] {
    std::istringstream words(
        "0 -1 1 2 65536 2147483647 -2147483648 4294967296 9223372036854775807 99999999999999999999 1e30 -1e9 1e-9 "
        "0.001 "
        "nan inf -inf 1e999 0x10 010");
    return std::vector<std::string>(std::istream_iterator<std::string>(words), {});
  }();
  return all;
}

inline std::string unescaped(const std::string& text) {
  std::string word;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\' || i + 1 >= text.size()) {
      word += text[i];
    } else if (text[i + 1] == 'x' && i + 3 < text.size()) {
      word += char(std::stoi(text.substr(i + 2, 2), nullptr, 16));
      i += 3;
    } else {
      word += text[++i];
    }
  }
  return word;
}

/// The words of a libFuzzer dictionary: "text" or name="text" on each line, with \xNN, \" and \\.
inline std::vector<std::string> read_dictionary(const std::filesystem::path& path) {
  std::ifstream stream(path);
  if (!stream) throw std::runtime_error("cannot read the dictionary " + path.string());
  std::vector<std::string> words;
  for (std::string line; std::getline(stream, line);) {
    const std::size_t first = line.find('"'), last = line.rfind('"');
    if (!line.starts_with('#') && first < last) words.push_back(unescaped(line.substr(first + 1, last - first - 1)));
  }
  return words;
}

/// Makes inputs from others: the same ones for the same seed.
class Mutator {
 public:
  Mutator(std::vector<std::string> words, std::uint64_t seed) : words_(std::move(words)), random_(seed) {}

  std::size_t below(std::size_t count) { return count ? std::size_t(random_() % count) : 0; }
  /// Makes one to eight changes. `other` is another input that gives parts.
  std::string mutated(std::string bytes, const std::string& other, std::size_t longest) {
    for (std::size_t changes = 1 + below(below(2) ? 2 : 8); changes > 0; --changes) change(bytes, other);
    if (bytes.size() > longest) bytes.resize(longest);
    return bytes;
  }

 private:
  void change(std::string& bytes, const std::string& other) {
    const std::size_t at = below(bytes.size());
    const std::size_t length = std::min(bytes.size() - at, 1 + below(below(4) ? 8 : 512));
    switch (below(11)) {
      case 0:
        if (!bytes.empty()) bytes[at] = char(bytes[at] ^ (1 << below(8)));
        break;
      case 1:
        if (!bytes.empty()) bytes[at] = char(random_());
        break;
      case 2:
        put_number(bytes);
        break;
      case 3:
        put_digits(bytes);
        break;
      case 4:
        bytes.erase(at, length);
        break;
      case 5:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 6:
        bytes.insert(at, std::string(1 + below(below(8) ? 16 : 3000), char(random_())));
        break;
      case 7:
        bytes.resize(at);
        break;
      case 8:  // a part of another input
        if (!other.empty()) {
          const std::size_t from = below(other.size());
          bytes.replace(at, below(2) ? length : 0, other.substr(from, 1 + below(below(2) ? 64 : other.size())));
        }
        break;
      default:
        if (!words_.empty()) {
          const std::string& word = words_[below(words_.size())];
          bytes.replace(at, below(2) ? std::min(word.size(), bytes.size() - at) : 0, word);
        }
    }
  }

  /// Writes a number of 1 to 8 bytes in either order: a power of two, or 1 or 2 less.
  void put_number(std::string& bytes) {
    const std::size_t width = std::size_t(1) << below(4);
    if (bytes.size() < width) return;
    const std::size_t at = below(bytes.size() - width + 1);
    const std::size_t bit = below(65);
    const std::uint64_t number = (bit < 64 ? std::uint64_t(1) << bit : 0) - below(3);
    const bool big_endian = below(2);
    for (std::size_t i = 0; i < width; ++i) bytes[at + i] = char(number >> 8 * (big_endian ? width - 1 - i : i));
  }

  /// Replaces a number in digits by another one.
  void put_digits(std::string& bytes) {
    std::vector<std::size_t> begins;
    const auto is_digit = [&](std::size_t i) {
      return i < bytes.size() && std::isdigit(static_cast<unsigned char>(bytes[i]));
    };
    for (std::size_t i = 0; i < bytes.size(); ++i)
      if (is_digit(i) && (i == 0 || !is_digit(i - 1))) begins.push_back(i);
    if (begins.empty()) return;
    const std::size_t begin = begins[below(begins.size())];
    std::size_t end = begin;
    while (is_digit(end)) ++end;
    bytes.replace(begin, end - begin, digits()[below(digits().size())]);
  }

  std::vector<std::string> words_;
  std::mt19937_64 random_;
};

}  // namespace marrow::fuzz
