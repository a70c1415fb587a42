// SPDX-License-Identifier: Apache-2.0
// A plain node of the kind read, and others that are wrong in one way each: the suite must catch each of them.
#include <fstream>
#include <sstream>

#include "wrong.hpp"

namespace {

struct Options {
  std::filesystem::path path;
};

/// The numbers of the matrix in a file of marrow's; none for another file.
std::vector<double> numbers_in(std::string text) {
  std::vector<double> numbers;
  const std::size_t begin = text.find("matrix:");
  if (!text.starts_with("marrow-pose: 1\n") || begin == std::string::npos) return numbers;
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '[' || c == ']' || c == ','; }, ' ');
  std::istringstream words(text.substr(begin + 7));
  for (std::string word; words >> word;)
    if (word != "-") numbers.push_back(std::stod(word));
  return numbers;
}

template <wrong::Fault fault>
marrow::Pose pose(const Options& options) {
  std::string text;
  if (std::filesystem::is_regular_file(options.path)) {
    std::ifstream stream(options.path);
    text.assign(std::istreambuf_iterator<char>(stream), {});
  }
  const std::vector<double> numbers = numbers_in(text);
  marrow::Pose found;
  if (numbers.size() != 16) {
    if (fault == "taking_anything") return found;
    throw marrow::Error((fault == "nameless" ? "the file" : options.path.string()) + " holds no pose of marrow");
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      found.world_from_model.rotation(row, column) = numbers[std::size_t(4 * row + column)];
    found.world_from_model.translation_mm[row] = numbers[std::size_t(4 * row + 3)];
  }
  if (fault == "shifted") found.world_from_model.translation_mm.x() += 0.01;
  return found;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "taking_anything", "nameless", "shifted">(
      plugin, "read", []<wrong::Fault fault>() { return &pose<fault>; },
      [](auto&& node) { node.out("pose", "the pose").option("path", &Options::path, "the file", marrow::required()); });
}
