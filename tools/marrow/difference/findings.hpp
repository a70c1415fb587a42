// SPDX-License-Identifier: Apache-2.0
#pragma once
// All differences between two runs, for people and for scripts.
#include <nlohmann/json.hpp>

#include "difference/changes.hpp"
#include "difference/known_values.hpp"

namespace marrow::cli {

inline constexpr const char *kIsNotThere = "it is not there", *kWasNotThere = "it was not there";

struct ItemDifference {
  std::string place;  ///< the item's place along the axes; empty outside lists
  std::string key_before, key_now;
  Amount amount;
};

/// An output of a node or of the run.
struct OutputDifference {
  std::string name;
  std::vector<ItemDifference> items;
  std::vector<std::string> notes;  ///< for example: it could not be written in one run
  std::size_t same = 0;            ///< number of items that are the same

  bool is_none() const { return items.empty() && notes.empty(); }
};

struct Findings {
  RunRecord before, now;
  RunDifference difference;               ///< refers to nodes of both runs
  std::vector<OutputDifference> first;    ///< differing outputs of the first root
  std::vector<OutputDifference> results;  ///< all outputs of the run
  std::vector<std::string> damaged;       ///< files of either run that are missing or changed since it wrote them

  bool identical() const;
  Findings(RunRecord before, RunRecord now);
  Findings(const Findings&) = delete;
  Findings(Findings&&) = default;
};

Findings find_differences(RunRecord before, RunRecord now, KnownValues& values);

void print(const Findings& findings);
nlohmann::json json_of(const Findings& findings);

}  // namespace marrow::cli
