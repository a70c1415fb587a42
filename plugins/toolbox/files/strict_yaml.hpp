// SPDX-License-Identifier: Apache-2.0
#pragma once
// Strict reading of YAML files (domain/yaml.hpp). Every map is read through YamlMap. All faults of a file are collected
// and thrown as one Error.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "marrow/base/yaml.hpp"

namespace marrow::files {

/// A parsed file and the faults found in it so far.
class YamlFile {
 public:
  /// Throws Error if the file cannot be opened, is larger than 16 MiB, is not YAML, is no map, or uses aliases. With
  /// aliases a small file could expand to a huge one.
  explicit YamlFile(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  const YAML::Node& root() const { return root_; }
  /// Notes a fault at a position in the file. If the mark is null, the fault concerns the whole file.
  void fault(const YAML::Mark& mark, const std::string& text);
  bool has_faults() const { return !faults_.empty(); }
  /// Whether 50 faults are noted. Further ones are only counted, so they need no advice.
  bool is_full() const { return faults_.size() >= kMostFaults; }
  /// Returns if there are no faults. Otherwise throws one Error with up to 50 faults, each as file:line:column with the
  /// source line, and the number of further ones.
  void finish() const;

 private:
  static constexpr std::size_t kMostFaults = 50;
  std::string describe(const YAML::Mark& mark, const std::string& text) const;

  std::filesystem::path path_;
  std::string text_;
  YAML::Node root_;
  std::vector<std::string> faults_;
  std::size_t more_faults_ = 0;
};

/// Marks a map whose keys are names chosen by the file's author.
struct FreeKeys {};

/// One map of a file. Unknown and repeated keys are faults. A getter notes a fault and returns nothing if its key is
/// missing or its value has the wrong form. For a missing key, `_or` getters return the default without a fault. The
/// file must outlive the map.
class YamlMap {
 public:
  /// `what` names the map in messages, as in "a view".
  YamlMap(YamlFile& file, const YAML::Node& node, std::string what, const std::vector<std::string>& known_keys);
  /// A map whose keys may be any valid names.
  YamlMap(YamlFile& file, const YAML::Node& node, std::string what, FreeKeys);

  YamlFile& file() const { return file_; }
  const std::string& what() const { return what_; }
  bool valid() const { return node_.IsMap(); }
  bool has(const std::string& key) const;
  /// The keys in the order of the file, each once. With free keys at most 1000.
  const std::vector<std::string>& keys() const { return keys_; }
  /// The value of a key, or an undefined node.
  YAML::Node node(const std::string& key) const;
  YAML::Mark mark() const { return node_.Mark(); }
  void fault(const std::string& key, const std::string& text) const;
  /// The value of a key. A missing key is a fault.
  std::optional<YAML::Node> required(const std::string& key) const;

  std::optional<std::string> text(const std::string& key) const;
  std::optional<double> number(const std::string& key) const;
  std::optional<int> integer(const std::string& key) const;
  bool boolean_or(const std::string& key, bool default_value) const;
  std::optional<Eigen::Vector3d> vector3(const std::string& key) const;
  /// A list of `count` numbers.
  std::optional<std::vector<double>> numbers(const std::string& key, std::size_t count) const;
  /// A matrix as a list of rows.
  std::optional<Eigen::MatrixXd> matrix(const std::string& key, int rows, int columns) const;
  /// A list of at least one point [x, y, z], in mm.
  std::vector<Eigen::Vector3d> points(const std::string& key) const;
  std::vector<std::string> texts_or_none(const std::string& key) const;

 private:
  /// Stores the keys. Repeated keys and keys that are not texts are faults. Calls `check` for each other key.
  template <class Check>
  void take_keys(Check check);

  YamlFile& file_;
  YAML::Node node_;
  std::string what_;
  std::vector<std::string> keys_;
  std::unordered_map<std::string, YAML::Node> values_;
};

}  // namespace marrow::files
