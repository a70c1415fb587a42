// SPDX-License-Identifier: Apache-2.0
#pragma once
// All that is to be said of two runs, for people and for scripts.
#include <nlohmann/json.hpp>

#include "difference/changes.hpp"
#include "difference/known_values.hpp"

namespace marrow::cli {

inline constexpr const char *kIsNotThere = "it is not there", *kWasNotThere = "it was not there";

struct ItemDifference {
  std::string place;  ///< along the axes; empty outside lists
  std::string key_before, key_now;
  Amount amount;
};

/// An output of a node or of the run.
struct OutputDifference {
  std::string name;
  std::vector<ItemDifference> items;
  std::vector<std::string> notes;  ///< it is only in one run, could not be written in one
  std::size_t same = 0;            ///< items

  bool is_none() const { return items.empty() && notes.empty(); }
};

struct Findings {
  RunRecord before, now;
  RunDifference difference;               ///< refers to nodes of both
  std::vector<OutputDifference> first;    ///< outputs of the first root that differ
  std::vector<OutputDifference> results;  ///< of the run, all of them
  std::vector<std::string> damaged;       ///< files of either run that are not what it wrote

  bool identical() const;
  Findings(RunRecord before, RunRecord now);
  Findings(const Findings&) = delete;
  Findings(Findings&&) = default;
};

Findings find_differences(RunRecord before, RunRecord now, KnownValues& values);

void print(const Findings& findings);
nlohmann::json json_of(const Findings& findings);

}  // namespace marrow::cli
