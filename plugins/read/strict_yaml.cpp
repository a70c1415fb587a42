// SPDX-License-Identifier: Apache-2.0
#include "strict_yaml.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>

#include "marrow/domain/error.hpp"

namespace marrow::read {
namespace {

constexpr std::uintmax_t kLargestFile = 16 << 20;

std::string read_text(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::exists(path, failure)) throw Error(path.string() + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, failure))
    throw Error(path.string() + ": expected a YAML file, this is none");
  if (std::filesystem::file_size(path, failure) > kLargestFile)
    throw Error(path.string() + ": expected a YAML file of at most 16 MB; this is larger");
  std::ifstream stream(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(stream)), {});
  if (!stream) throw Error(path.string() + ": cannot be read");
  return text;
}

std::vector<std::string> split_lines(const std::string& text) {
  std::vector<std::string> lines(1);
  for (char c : text) {
    if (c == '\n')
      lines.emplace_back();
    else if (c != '\r')
      lines.back() += c;
  }
  return lines;
}

/// A number in full, finite, decimal: none of yaml-cpp's octal, hexadecimal, .inf or quoted numbers.
std::optional<double> parse_number(const YAML::Node& node) {
  if (!node.IsScalar() || node.Tag() == "!") return std::nullopt;
  const std::string& text = node.Scalar();
  const char* first = text.data() + (!text.empty() && text[0] == '+' ? 1 : 0);
  const char* last = text.data() + text.size();
  double value = 0;
  const auto [end, failure] = std::from_chars(first, last, value);
  if (failure != std::errc() || end != last || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string got(const YAML::Node& node) {
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return "a list of " + std::to_string(node.size());
  if (node.IsNull()) return "nothing";
  const std::string text = node.Scalar().substr(0, 40);
  return node.Tag() == "!" ? "the quoted text \"" + text + "\"" : "'" + text + "'";
}

}  // namespace

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : known) {
    std::vector<std::size_t> row(candidate.size() + 1);
    std::iota(row.begin(), row.end(), 0);
    for (std::size_t i = 0; i < word.size(); ++i) {
      std::size_t diagonal = std::exchange(row[0], i + 1);
      for (std::size_t j = 0; j < candidate.size(); ++j) {
        const std::size_t replaced = diagonal + (word[i] != candidate[j]);
        diagonal = std::exchange(row[j + 1], std::min({row[j] + 1, row[j + 1] + 1, replaced}));
      }
    }
    if (row.back() < best_distance) {
      best_distance = row.back();
      best = candidate;
    }
  }
  return best;
}

YamlFile::YamlFile(std::filesystem::path path) : path_(std::move(path)) {
  const std::string text = read_text(path_);
  lines_ = split_lines(text);
  if (text.find('\0') != std::string::npos) throw Error(path_.string() + ": expected YAML text; this file is binary");
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    if (documents.size() > 1)
      throw Error(path_.string() + ": expected one YAML document, got " + std::to_string(documents.size()));
    if (!documents.empty()) root_ = documents[0];
  } catch (const YAML::Exception& error) {
    throw Error(describe(error.mark, "not YAML: " + error.msg));
  }
  if (!root_.IsMap()) throw Error(path_.string() + ": expected a YAML map of keys and values, got " + got(root_));
}

std::string YamlFile::describe(const YAML::Mark& mark, const std::string& text) const {
  if (mark.is_null()) return path_.string() + ": " + text;
  std::string message =
      path_.string() + ":" + std::to_string(mark.line + 1) + ":" + std::to_string(mark.column + 1) + ": " + text;
  if (mark.line >= 0 && std::size_t(mark.line) < lines_.size())
    message += "\n    " + lines_[std::size_t(mark.line)].substr(0, 120);
  return message;
}

void YamlFile::fault(const YAML::Mark& mark, const std::string& text) {
  faults_.push_back(describe(mark, text));
}

void YamlFile::finish() const {
  if (faults_.empty()) return;
  std::string all;
  for (const std::string& fault : faults_) all += (all.empty() ? "" : "\n") + fault;
  throw Error(all);
}

YamlMap::YamlMap(YamlFile& file, const YAML::Node& node, std::string what, const std::vector<std::string>& known_keys)
    : file_(file), node_(node), what_(std::move(what)) {
  if (!node_.IsMap()) {
    file_.fault(node_.Mark(), what_ + ": expected keys and values, got " + got(node_));
    return;
  }
  std::map<std::string, int> line_of;
  for (const auto& item : node_) {
    const std::string key = item.first.IsScalar() ? item.first.Scalar() : "";
    if (const auto before = line_of.find(key); before != line_of.end())
      file_.fault(item.first.Mark(),
                  what_ + ": key '" + key + "' is already given in line " + std::to_string(before->second));
    line_of.emplace(key, item.first.Mark().line + 1);
    if (std::find(known_keys.begin(), known_keys.end(), key) != known_keys.end()) continue;
    std::string advice;
    if (const std::string near = nearest(key, known_keys); !near.empty()) {
      advice = "; did you mean '" + near + "'?";
    } else {
      for (const std::string& known : known_keys) advice += (advice.empty() ? "; known are " : ", ") + known;
    }
    file_.fault(item.first.Mark(), what_ + ": unknown key '" + key + "'" + advice);
  }
}

bool YamlMap::has(const std::string& key) const {
  return node(key).IsDefined();
}

YAML::Node YamlMap::node(const std::string& key) const {
  if (node_.IsMap())
    for (const auto& item : node_)
      if (item.first.IsScalar() && item.first.Scalar() == key) return item.second;
  return YAML::Node(YAML::NodeType::Undefined);
}

void YamlMap::fault(const std::string& key, const std::string& text) const {
  const YAML::Node value = node(key);
  file_.fault(value.IsDefined() ? value.Mark() : node_.Mark(), what_ + ": " + text);
}

std::optional<YAML::Node> YamlMap::required(const std::string& key) const {
  if (!valid()) return std::nullopt;  // already a fault
  const YAML::Node value = node(key);
  if (value.IsDefined()) return value;
  fault(key, "key '" + key + "' is missing");
  return std::nullopt;
}

std::optional<std::string> YamlMap::text(const std::string& key) const {
  const auto value = required(key);
  if (!value) return std::nullopt;
  if (value->IsScalar() && !value->Scalar().empty()) return value->Scalar();
  fault(key, key + ": expected a text, got " + got(*value));
  return std::nullopt;
}

std::optional<double> YamlMap::number(const std::string& key) const {
  const auto value = required(key);
  if (!value) return std::nullopt;
  const auto number = parse_number(*value);
  if (!number) fault(key, key + ": expected a number, got " + got(*value));
  return number;
}

std::optional<int> YamlMap::integer(const std::string& key) const {
  const auto value = required(key);
  if (!value) return std::nullopt;
  const auto number = parse_number(*value);
  if (number && *number == std::floor(*number) && std::abs(*number) <= 1e9) return int(*number);
  fault(key, key + ": expected a whole number, got " + got(*value));
  return std::nullopt;
}

bool YamlMap::boolean_or(const std::string& key, bool default_value) const {
  if (!has(key)) return default_value;
  const YAML::Node value = node(key);
  if (value.IsScalar() && value.Tag() != "!") {
    if (value.Scalar() == "true") return true;
    if (value.Scalar() == "false") return false;
  }
  fault(key, key + ": expected true or false, got " + got(value));
  return default_value;
}

std::optional<std::vector<double>> YamlMap::numbers(const std::string& key, std::size_t count) const {
  const auto value = required(key);
  if (!value) return std::nullopt;
  std::vector<double> numbers;
  if (value->IsSequence() && value->size() == count)
    for (const auto& item : *value)
      if (const auto number = parse_number(item)) numbers.push_back(*number);
  if (numbers.size() == count) return numbers;
  fault(key, key + ": expected " + std::to_string(count) + " numbers" + (count == 3 ? " [x, y, z]" : "") + ", got " +
                 got(*value));
  return std::nullopt;
}

std::optional<Eigen::Vector3d> YamlMap::vector3(const std::string& key) const {
  const auto vector = numbers(key, 3);
  if (!vector) return std::nullopt;
  return Eigen::Vector3d(vector->data());
}

std::optional<Eigen::MatrixXd> YamlMap::matrix(const std::string& key, int rows, int columns) const {
  const auto value = required(key);
  if (!value) return std::nullopt;
  Eigen::MatrixXd matrix(rows, columns);
  bool good = value->IsSequence() && int(value->size()) == rows;
  for (int r = 0; good && r < rows; ++r) {
    const YAML::Node row = (*value)[r];
    good = row.IsSequence() && int(row.size()) == columns;
    for (int c = 0; good && c < columns; ++c) {
      const auto number = parse_number(row[c]);
      good = number.has_value();
      if (good) matrix(r, c) = *number;
    }
  }
  if (good) return matrix;
  fault(key, key + ": expected " + std::to_string(rows) + " rows of " + std::to_string(columns) + " numbers, got " +
                 got(*value));
  return std::nullopt;
}

std::vector<Eigen::Vector3d> YamlMap::points(const std::string& key) const {
  std::vector<Eigen::Vector3d> points;
  const auto value = required(key);
  if (!value) return points;
  if (!value->IsSequence() || value->size() == 0) {
    fault(key, key + ": expected a list of points [[x, y, z], ...], got " + got(*value));
    return points;
  }
  for (const auto& item : *value) {
    Eigen::Vector3d point;
    bool good = item.IsSequence() && item.size() == 3;
    for (int i = 0; good && i < 3; ++i) {
      const auto number = parse_number(item[i]);
      good = number.has_value();
      if (good) point[i] = *number;
    }
    if (good)
      points.push_back(point);
    else
      file_.fault(item.Mark(), what_ + ": " + key + ": expected a point [x, y, z] in mm, got " + got(item));
  }
  return points;
}

std::vector<std::string> YamlMap::texts_or_none(const std::string& key) const {
  std::vector<std::string> texts;
  if (!has(key)) return texts;
  const YAML::Node value = node(key);
  bool good = value.IsSequence();
  if (good)
    for (const auto& item : value) {
      good = good && item.IsScalar();
      if (item.IsScalar()) texts.push_back(item.Scalar());
    }
  if (!good) fault(key, key + ": expected a list of texts, got " + got(value));
  return texts;
}

}  // namespace marrow::read
