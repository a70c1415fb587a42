// SPDX-License-Identifier: Apache-2.0
#pragma once
// Strict reading of YAML files (domain/yaml.hpp): every map is read through YamlMap. All faults of a file are collected
// and thrown together.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "marrow/domain/yaml.hpp"

namespace marrow::files {

/// A parsed file and the faults found in it so far.
class YamlFile {
 public:
  /// Throws Error when the file cannot be opened or is not YAML, or refers from one place to another (aliases), by
  /// which a small file could stand for a huge one.
  explicit YamlFile(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  const YAML::Node& root() const { return root_; }
  /// Notes a fault at a place, or at the top of the file where the mark is null.
  void fault(const YAML::Mark& mark, const std::string& text);
  bool has_faults() const { return !faults_.empty(); }
  /// Whether so many faults are noted that more are only counted, so that they need no advice.
  bool is_full() const { return faults_.size() >= kMostFaults; }
  /// Throws one Error that holds the faults, each as file:line:column with the source line; returns when there are
  /// none. Of more than 50 the rest is counted.
  void finish() const;

 private:
  static constexpr std::size_t kMostFaults = 50;
  std::string describe(const YAML::Mark& mark, const std::string& text) const;

  std::filesystem::path path_;
  std::vector<std::string> lines_;
  YAML::Node root_;
  std::vector<std::string> faults_;
  std::size_t more_faults_ = 0;
};

/// Says of a map that its keys are names that its author chose.
struct FreeKeys {};

/// One map of a file, whose keys are all known: unknown and repeated keys are faults. A getter whose key is missing or
/// whose value is of the wrong form notes a fault and returns nothing (a `_or` getter takes a missing key as the
/// default).
class YamlMap {
 public:
  /// `what` names the map in messages, as in "a view".
  YamlMap(YamlFile& file, const YAML::Node& node, std::string what, const std::vector<std::string>& known_keys);
  /// A map of which each key is good that can be a name.
  YamlMap(YamlFile& file, const YAML::Node& node, std::string what, FreeKeys);

  YamlFile& file() const { return file_; }
  const std::string& what() const { return what_; }
  bool valid() const { return node_.IsMap(); }
  bool has(const std::string& key) const;
  /// The keys in the order of the file, each once; at most 1000 of a map whose keys are free.
  const std::vector<std::string>& keys() const { return keys_; }
  /// The value of a key, or a node that is not defined.
  YAML::Node node(const std::string& key) const;
  YAML::Mark mark() const { return node_.Mark(); }
  void fault(const std::string& key, const std::string& text) const;
  /// The value of a key that must be there.
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
  /// A list of points, each [x, y, z]; at least one.
  std::vector<Eigen::Vector3d> points(const std::string& key) const;
  std::vector<std::string> texts_or_none(const std::string& key) const;

 private:
  /// Takes up the keys; those that are there already, or no texts, are faults. `check` is called for each other one.
  template <class Check>
  void take_keys(Check check);

  YamlFile& file_;
  YAML::Node node_;
  std::string what_;
  std::vector<std::string> keys_;
  std::unordered_map<std::string, YAML::Node> values_;
};

}  // namespace marrow::files
