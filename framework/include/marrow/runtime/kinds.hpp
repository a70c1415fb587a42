// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace marrow {

/// A port that nodes of a kind may have.
struct KindPort {
  std::string name;
  std::string type;  ///< id of the value type
  std::string axis;  ///< of a list port
};

/// A kind is the part of a node's name before the dot, and a contract that makes its nodes replaceable by each other in
/// one line: the inputs that any of them may use, and the outputs that each of them has.
struct Kind {
  std::string name;
  std::string help;
  std::vector<KindPort> inputs, outputs;
  bool open = false;        ///< its nodes choose their ports freely
  bool sees_truth = false;  ///< only such a kind may be given the truth
  /// Nodes that name files by options are called in a process of their own, whose limits follow the size of the files:
  /// those that only parse take little beside what they read, those that compute take their time.
  enum class Apart { no, parses, computes } apart = Apart::no;
};

/// All kinds with a contract. A node of any other kind chooses its ports freely.
const std::vector<Kind>& kinds();
/// The kind of that name, or nullptr.
const Kind* find_kind(std::string_view name);

}  // namespace marrow
