// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <random>
#include <string>
#include <vector>

namespace marrow::fuzz {

/// The words of a libFuzzer dictionary: "text" or name="text" on each line, with \xNN, \" and \\.
std::vector<std::string> read_dictionary(const std::filesystem::path& path);

/// Makes inputs from others: the same ones for the same seed.
class Mutator {
 public:
  Mutator(std::vector<std::string> words, std::uint64_t seed) : words_(std::move(words)), random_(seed) {}

  std::size_t below(std::size_t count) { return count ? std::size_t(random_() % count) : 0; }
  /// Makes one to eight changes. `other` is another input that gives parts.
  std::string mutated(std::string bytes, const std::string& other, std::size_t longest);

 private:
  void change(std::string& bytes, const std::string& other);
  void put_number(std::string& bytes);
  void put_digits(std::string& bytes);

  std::vector<std::string> words_;
  std::mt19937_64 random_;
};

}  // namespace marrow::fuzz
