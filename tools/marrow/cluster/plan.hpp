// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is left of a comparison, cut into chunks that tasks of a cluster do: FOLDER/plans/ID.json.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "compare/comparison.hpp"

namespace marrow::cli {

/// Work for one task.
struct Chunk {
  std::string name;                  ///< "ID-0007", or "ID-cases-0007"
  std::vector<std::size_t> numbers;  ///< of cells, as in cells_of(), or of cases
};

struct ClusterPlan {
  std::string id;                                   ///< a digest of everything below
  std::filesystem::path file, folder;               ///< the experiment and its comparison's folder, absolute
  std::map<std::string, std::string> texts;         ///< digest of each file that people wrote, by its path
  std::map<std::string, std::string> builds;        ///< build id of each plugin, by the node that it makes
  std::map<std::string, std::string> case_digests;  ///< content of the cases that are folders, by name
  int threads = 1;
  double time_limit_s = 600, memory_limit_mb = 4000;
  bool no_cache = false;
  FileLimits file_limits;
  std::vector<Chunk> cases, cells;  ///< cases to be made first; cells that have no row yet

  std::filesystem::path place() const { return folder / "plans" / (id + ".json"); }
};

/// How cells are grouped.
struct ChunkRule {
  double least_minutes = 10;      ///< of one task, by the estimate
  std::size_t most_tasks = 1000;  ///< with more, each task gets longer instead
};

/// Cuts cells into chunks. The cells of a case share work, so they stay together unless they are much more than a
/// chunk. `numbers` are in rising order.
std::vector<std::vector<std::size_t>> cut_into_chunks(const std::vector<std::size_t>& numbers,
                                                      std::size_t cells_of_a_case, double seconds_of_a_cell,
                                                      const ChunkRule& rule);

/// Makes the plan of the cells that are left, and writes it if there are any. Runs nothing. Throws Error if it cannot
/// be written.
ClusterPlan make_plan(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
                      const std::filesystem::path& folder, const ChunkRule& rule);

/// Throws Error if the file is no plan.
ClusterPlan read_plan(const std::filesystem::path& file);
/// The newest plan in a comparison's folder. Throws Error if there is none.
ClusterPlan latest_plan(const std::filesystem::path& folder);
/// Throws Error if the experiment, its pipelines, a plugin or a case is not what it was when the plan was made.
void expect_as_planned(const ClusterPlan& plan, const Catalogue& catalogue, const compare::Experiment& experiment);

}  // namespace marrow::cli
