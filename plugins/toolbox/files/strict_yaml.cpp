// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/strict_yaml.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {
namespace {

constexpr std::uint64_t kLargestYaml = 16 << 20;
constexpr std::size_t kMostValues = 1'000'000, kMostFreeKeys = 1000;

/// The list of exactly `count` numbers; nothing for anything else.
std::optional<std::vector<double>> list_of_numbers(const YAML::Node& node, std::size_t count) {
  if (!node.IsSequence() || node.size() != count) return std::nullopt;
  std::vector<double> numbers;
  for (const auto& item : node)
    if (const auto number = yaml_number(item)) numbers.push_back(*number);
  if (numbers.size() != count) return std::nullopt;
  return numbers;
}

}  // namespace

YamlFile::YamlFile(std::filesystem::path path) : path_(std::move(path)) {
  text_ = read_text(path_, kLargestYaml, true);
  if (text_.find('\0') != std::string::npos) throw Error(path_.string() + ": expected YAML text; this file is binary");
  try {
    root_ = parse_yaml(text_, {false, kMostValues});
  } catch (const YAML::ParserException& error) {
    throw Error(describe(error.mark, "not YAML: " + error.msg.substr(0, 200)));
  } catch (const YAML::Exception& error) {
    throw Error(describe(error.mark, error.msg.substr(0, 200)));
  }
  if (!root_.IsMap())
    throw Error(path_.string() + ": expected a YAML map of keys and values, got " + yaml_described(root_));
}

std::string YamlFile::describe(const YAML::Mark& mark, const std::string& text) const {
  if (mark.is_null()) return path_.string() + ": " + text;
  std::string message = formatted("{}:{}:{}: {}", path_.string(), mark.line + 1, mark.column + 1, text);
  std::istringstream lines(text_);
  std::string line;
  int number = -1;
  while (number < mark.line && std::getline(lines, line)) ++number;
  if (number == mark.line) message += "\n    " + line.substr(0, 120);
  return message;
}

void YamlFile::fault(const YAML::Mark& mark, const std::string& text) {
  if (is_full())
    ++more_faults_;
  else
    faults_.push_back(describe(mark, text));
}

void YamlFile::finish() const {
  if (faults_.empty()) return;
  std::string all;
  for (const std::string& fault : faults_) all += (all.empty() ? "" : "\n") + fault;
  if (more_faults_ > 0) all += formatted("\n... and {} more", more_faults_);
  throw Error(all);
}

YamlMap::YamlMap(YamlFile& file, const YAML::Node& node, std::string what, const std::vector<std::string>& known_keys)
    : file_(file), node_(node), what_(std::move(what)) {
  take_keys([&](const std::string& key, const YAML::Mark& mark) {
    if (std::find(known_keys.begin(), known_keys.end(), key) != known_keys.end()) return;
    const std::string advice = file_.is_full() ? "" : "; " + suggestion(key, known_keys);
    file_.fault(mark, what_ + ": unknown key " + in_quotes(key.substr(0, 100)) + advice);
  });
}

YamlMap::YamlMap(YamlFile& file, const YAML::Node& node, std::string what, FreeKeys)
    : file_(file), node_(node), what_(std::move(what)) {
  take_keys([&](const std::string& key, const YAML::Mark& mark) {
    const std::string fault = fault_of_item_name(key);
    if (!fault.empty()) file_.fault(mark, what_ + ": a name " + fault + "; choose another");
    if (keys_.size() == kMostFreeKeys + 1) file_.fault(mark, what_ + ": there are more than 1000 of them");
  });
  keys_.resize(std::min(keys_.size(), kMostFreeKeys));
}

template <class Check>
void YamlMap::take_keys(Check check) {
  if (!node_.IsMap()) {
    file_.fault(node_.Mark(), what_ + ": expected keys and values, got " + yaml_described(node_));
    return;
  }
  std::vector<YamlFault> faults;
  for (const YamlKey& key : yaml_keys(node_, what_, faults)) {
    keys_.push_back(key.name);
    values_.emplace(key.name, key.value);
    check(key.name, key.mark);
  }
  for (const YamlFault& one : faults)
    file_.fault(one.mark, printable(one.text) + (one.hint.empty() ? "" : "; " + one.hint));
}

bool YamlMap::has(const std::string& key) const { return node(key).IsDefined(); }

YAML::Node YamlMap::node(const std::string& key) const {
  const auto found = values_.find(key);
  return found == values_.end() ? YAML::Node(YAML::NodeType::Undefined) : found->second;
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
  fault(key, key + ": expected a text, got " + yaml_described(*value));
  return std::nullopt;
}

std::optional<double> YamlMap::number(const std::string& key) const {
  const auto value = required(key);
  if (!value) return std::nullopt;
  const auto number = yaml_number(*value);
  if (!number) fault(key, key + ": expected a number, got " + yaml_described(*value));
  return number;
}

std::optional<int> YamlMap::integer(const std::string& key) const {
  const auto value = required(key);
  if (!value) return std::nullopt;
  const std::optional<std::int64_t> number = yaml_integer(*value);
  if (number && std::abs(*number) <= 1'000'000'000) return int(*number);
  fault(key, key + ": expected a whole number, got " + yaml_described(*value) +
                 (has_leading_zeros(*value) ? "; write it without leading zeros" : ""));
  return std::nullopt;
}

bool YamlMap::boolean_or(const std::string& key, bool default_value) const {
  if (!has(key)) return default_value;
  const std::optional<bool> value = yaml_boolean(node(key));
  if (!value) fault(key, key + ": expected true or false, got " + yaml_described(node(key)));
  return value.value_or(default_value);
}

std::optional<std::vector<double>> YamlMap::numbers(const std::string& key, std::size_t count) const {
  const auto value = required(key);
  if (!value) return std::nullopt;
  if (auto numbers = list_of_numbers(*value, count)) return numbers;
  fault(key, formatted("{}: expected {} numbers{}, got {}", key, count, count == 3 ? " [x, y, z]" : "",
                       yaml_described(*value)));
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
    const auto row = list_of_numbers((*value)[r], std::size_t(columns));
    good = row.has_value();
    if (good) matrix.row(r) = Eigen::Map<const Eigen::RowVectorXd>(row->data(), columns);
  }
  if (good) return matrix;
  fault(key, formatted("{}: expected {} rows of {} numbers, got {}", key, rows, columns, yaml_described(*value)));
  return std::nullopt;
}

std::vector<Eigen::Vector3d> YamlMap::points(const std::string& key) const {
  std::vector<Eigen::Vector3d> points;
  const auto value = required(key);
  if (!value) return points;
  if (!value->IsSequence() || value->size() == 0) {
    fault(key, key + ": expected a list of points [[x, y, z], ...], got " + yaml_described(*value));
    return points;
  }
  for (const auto& item : *value) {
    if (const auto point = list_of_numbers(item, 3))
      points.emplace_back(point->data());
    else
      file_.fault(item.Mark(), what_ + ": " + key + ": expected a point [x, y, z] in mm, got " + yaml_described(item));
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
  if (!good) fault(key, key + ": expected a list of texts, got " + yaml_described(value));
  return texts;
}

}  // namespace marrow::files
