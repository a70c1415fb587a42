// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds the nodes that have different results in two runs, and why.
#include <string>
#include <vector>

#include "difference/run_record.hpp"

namespace marrow::cli {

/// Something that a node got in one run and not in the other.
struct Change {
  std::string what;  ///< uses, plugin, option, content, seed, wire, unknown
  std::string node;  ///< the node that it belongs to
  std::string name;  ///< name of the option or of the input
  std::string before, now;
  std::string text;  ///< "option 'high' is 80, was 75"
};

/// A node whose results differ although the data from other nodes do not differ.
struct Root {
  const RecordedNode* before;
  const RecordedNode* now;
  std::vector<Change> why;
};

struct RunDifference {
  std::vector<Root> roots;                  ///< in the pipeline's order; the runs begin to differ at the first one
  std::vector<std::string> in_consequence;  ///< nodes that differ because a node before them differs
  std::vector<Change> others;               ///< changes of nodes that do not explain a root
  std::vector<std::string> only_before, only_now;
  std::vector<Change> rebuilt;  ///< plugins that both runs used in different builds
  std::size_t same = 0;         ///< number of nodes with the same result in both runs

  bool is_none() const { return roots.empty() && only_before.empty() && only_now.empty(); }
};

RunDifference difference_of(const RunRecord& before, const RunRecord& now);

}  // namespace marrow::cli
