// SPDX-License-Identifier: Apache-2.0
#pragma once
// `marrow compare` with --on, --emit, --status, --cancel and --gather.
#include "cluster/plan.hpp"

namespace marrow::cli {

struct ClusterRequest {
  std::string on;    ///< "slurm", or empty
  std::string emit;  ///< "snakemake" or "parallel", or empty
  std::filesystem::path profile;
  bool wait = false, status = false, cancel = false;
  bool as_json = false;  ///< of the status
  ChunkRule rule;

  bool is_given() const { return !on.empty() || !emit.empty() || status || cancel; }
};

void add_cluster_options(CLI::App* command, CompareRequest& request, ClusterRequest& cluster);

/// Does what the options ask for, and returns the exit code.
int compare_on_cluster(const CompareRequest& asked, const ClusterRequest& cluster, const Catalogue& catalogue,
                       const compare::Experiment& experiment, const std::filesystem::path& folder);

}  // namespace marrow::cli
