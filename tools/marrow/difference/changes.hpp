// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which nodes of two runs came out otherwise, and why.
#include <string>
#include <vector>

#include "difference/run_record.hpp"

namespace marrow::cli {

/// Something that a node was given in one run and not in the other.
struct Change {
  std::string what;  ///< uses, plugin, option, content, seed, wire, unknown
  std::string node;  ///< whose it is
  std::string name;  ///< of the option or the input
  std::string before, now;
  std::string text;  ///< "option 'high' is 80, was 75"
};

/// A node whose results differ although the data that it takes from other nodes do not.
struct Root {
  const RecordedNode* before;
  const RecordedNode* now;
  std::vector<Change> why;
};

struct RunDifference {
  std::vector<Root> roots;                  ///< in the pipeline's order: the first is where the runs part
  std::vector<std::string> in_consequence;  ///< nodes that differ because a node before them does
  std::vector<Change> others;               ///< changes of nodes that are no reason of a root
  std::vector<std::string> only_before, only_now;
  std::vector<Change> rebuilt;  ///< plugins that both runs used, of another build
  std::size_t same = 0;         ///< nodes that took part in both and came out the same

  bool is_none() const { return roots.empty() && only_before.empty() && only_now.empty(); }
};

RunDifference difference_of(const RunRecord& before, const RunRecord& now);

}  // namespace marrow::cli
