// SPDX-License-Identifier: Apache-2.0
#pragma once
// A kind as plain data. A kind is the part of a node's name before the dot, together with a contract. Because of the
// contract, one changed line of a pipeline replaces a node by another of its kind. Libraries declare kinds and nodes.
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT marrow {

/// A port of the contract. A node declares it with one of these types.
struct KindPort {
  std::string name;
  std::string help;
  std::vector<TypeInfo> types;
  std::string axis;  ///< axis of a list port; empty for one item
};

/// A property that some nodes of a kind have. The kind's suite checks it.
struct TraitInfo {
  std::string name;
  std::string help;
};

/// A check of the kind's suite.
struct CheckInfo {
  std::string name;
  std::string what;  ///< what it checks, in one line
  double limit = 0;  ///< the largest value that it may measure
  std::string unit;  ///< unit of the limit; "" if it has none
};

/// Whether nodes of a kind are called in their own process if their options name files. The limits of this process
/// depend on the size of the files: they are tight for nodes that only parse, and wide for nodes that also compute.
enum class Apart { no, parses, computes };

struct KindInfo {
  std::string name;
  std::string summary;
  std::vector<KindPort> inputs;   ///< inputs that its nodes may have; a node may have others too
  std::vector<KindPort> outputs;  ///< outputs that each of its nodes has; a node may have others too
  bool sees_truth = false;        ///< whether its nodes may be given the truth
  Apart apart = Apart::no;
  std::vector<TraitInfo> traits;
  std::vector<CheckInfo> checks;  ///< the checks of its suite
};

}  // namespace marrow
