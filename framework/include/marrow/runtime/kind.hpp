// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is known of a kind, as plain data. A kind is the part of a node's name before the dot, and a contract that makes
// its nodes replaceable by each other in one line. Kinds are brought by libraries, as nodes are.
#include <string>
#include <vector>

#include "marrow/runtime/value.hpp"

namespace marrow {

/// A port of the contract. A node gives it one of the types.
struct KindPort {
  std::string name;
  std::string help;
  std::vector<TypeInfo> types;
  std::string axis;  ///< of a list port
};

/// Something that is true of some nodes of a kind, and that its suite checks.
struct TraitInfo {
  std::string name;
  std::string help;
};

/// A check of the kind's suite.
struct CheckInfo {
  std::string name;
  std::string what;  ///< in one line
  double limit = 0;  ///< the most that it may measure
  std::string unit;  ///< of the limit; "" where there is none
};

/// Nodes of some kinds are called in a process of their own where their options name files. Its limits follow the size
/// of the files: nodes that only parse take little beside what they read, those that compute take their time.
enum class Apart { no, parses, computes };

struct KindInfo {
  std::string name;
  std::string summary;
  std::vector<KindPort> inputs;   ///< that its nodes may have; a node may have further ones
  std::vector<KindPort> outputs;  ///< that each of its nodes has; a node may have further ones
  bool sees_truth = false;        ///< only nodes of such a kind may be given the truth
  Apart apart = Apart::no;
  std::vector<TraitInfo> traits;
  std::vector<CheckInfo> checks;  ///< of its suite
};

}  // namespace marrow
