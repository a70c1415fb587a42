// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/strict_yaml.hpp"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <sstream>

#include "marrow/domain/error.hpp"
#include "marrow/domain/names.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {
namespace {

constexpr std::uint64_t kLargestFile = 16 << 20;
constexpr std::size_t kMostNodes = 1'000'000, kMostFreeKeys = 1000, kLongestWord = 64, kMostCompared = 1000;

struct Refusal : YAML::Exception {
  using YAML::Exception::Exception;
};

/// What is looked at before a tree is made of a file: its nodes cost some hundred bytes each.
class Census final : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override {
    // Of some texts that are no YAML, such as a single comma, the parser makes documents without end.
    if (documents_++) throw Refusal(mark, "expected one YAML document, got more");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { count(mark, anchor); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { refuse(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, const std::string& text) override {
    if (text.find('\0') != std::string::npos)  // names of files and sentences would end there
      throw Refusal(mark, "a text holds the character NUL (\\0); take it out");
    count(mark, anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    count(mark, anchor);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    count(mark, anchor);
  }
  void OnMapEnd() override {}

 private:
  [[noreturn]] static void refuse(const YAML::Mark& mark) {
    throw Refusal(mark, "anchors and aliases (&name, *name) are not read; write the value out");
  }
  void count(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor != 0) refuse(mark);
    if (++nodes_ > kMostNodes) throw Refusal(mark, "it has more than 1000000 values");
  }
  std::size_t nodes_ = 0;
  int documents_ = 0;
};

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
  if (word.size() > kLongestWord) return best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (std::size_t n = 0; n < std::min(known.size(), kMostCompared); ++n) {
    const std::string& candidate = known[n];
    if (candidate.size() > kLongestWord) continue;
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
  const std::string text = read_bytes(path_, kLargestFile, true);
  lines_ = split_lines(text);
  if (text.find('\0') != std::string::npos) throw Error(path_.string() + ": expected YAML text; this file is binary");
  try {
    std::istringstream stream(text);
    Census census;
    YAML::Parser parser(stream);
    bool is_empty = true;
    while (parser.HandleNextDocument(census)) is_empty = false;
    if (!is_empty) root_ = YAML::Load(text);
  } catch (const Refusal& refusal) {
    throw Error(describe(refusal.mark, refusal.msg));
  } catch (const YAML::Exception& error) {
    throw Error(describe(error.mark, "not YAML: " + error.msg.substr(0, 200)));
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
  if (is_full())
    ++more_faults_;
  else
    faults_.push_back(describe(mark, text));
}

void YamlFile::finish() const {
  if (faults_.empty()) return;
  std::string all;
  for (const std::string& fault : faults_) all += (all.empty() ? "" : "\n") + fault;
  if (more_faults_ > 0) all += "\n... and " + std::to_string(more_faults_) + " more";
  throw Error(all);
}

YamlMap::YamlMap(YamlFile& file, const YAML::Node& node, std::string what, const std::vector<std::string>& known_keys)
    : file_(file), node_(node), what_(std::move(what)) {
  take_keys([&](const std::string& key, const YAML::Mark& mark) {
    if (std::find(known_keys.begin(), known_keys.end(), key) != known_keys.end()) return;
    std::string advice;
    if (const std::string near = file_.is_full() ? "" : nearest(key, known_keys); !near.empty()) {
      advice = "; did you mean '" + near + "'?";
    } else {
      for (const std::string& known : known_keys) advice += (advice.empty() ? "; known are " : ", ") + known;
    }
    file_.fault(mark, what_ + ": unknown key '" + key.substr(0, 100) + "'" + advice);
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
    file_.fault(node_.Mark(), what_ + ": expected keys and values, got " + got(node_));
    return;
  }
  std::unordered_map<std::string, int> line_of;
  for (const auto& item : node_) {
    const std::string key = item.first.IsScalar() ? item.first.Scalar() : "";
    const YAML::Mark mark = item.first.Mark();
    const auto [before, is_new] = line_of.emplace(key, mark.line + 1);
    if (!is_new) {
      file_.fault(mark, what_ + ": key '" + key.substr(0, 100) + "' is already given in line " +
                            std::to_string(before->second));
      continue;
    }
    keys_.push_back(key);
    values_.emplace(key, item.second);
    check(key, mark);
  }
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

}  // namespace marrow::files
