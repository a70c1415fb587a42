// SPDX-License-Identifier: Apache-2.0
#pragma once
// The progress of a plan, and following it on Slurm. The rows decide, not what the cluster says about its tasks.
#include <string>

#include "cluster/plan.hpp"
#include "cluster/profile.hpp"

namespace marrow::cli {

/// The chunks whose rows are all there.
struct Made {
  std::size_t chunks = 0, cells = 0;
};
Made made_of(const std::vector<Chunk>& chunks, const std::map<std::string, bool>& files);

std::size_t cells_of_plan(const ClusterPlan& plan);

/// "120 of 200 cells in 12 of 20 chunks"
std::string progress_of(const ClusterPlan& plan);

/// Prints Gathered::lost as an error. Nothing if it is empty.
void say_lost(const std::string& lost);

/// Follows what was submitted until its report is made. Ctrl-C ends it on the cluster, too. Ends tasks that the cluster
/// believes to be running although all their rows were written long ago. Throws Error if the report will not be made:
/// the job that makes it has ended or is forgotten, tasks are held back, or the cluster does not answer for
/// `silence_s`. Returns the exit code: 1 if cells are lost, 130 after Ctrl-C.
int follow(const ClusterPlan& plan, const ClusterProfile& profile, bool quiet);

}  // namespace marrow::cli
