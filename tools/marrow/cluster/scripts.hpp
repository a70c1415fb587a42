// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files beside a plan by which other programs run its chunks.
#include <filesystem>
#include <string>
#include <vector>

#include "cluster/plan.hpp"
#include "cluster/profile.hpp"

namespace marrow::cli {

/// Names of chunks, one on each line.
void write_list(const std::filesystem::path& file, const std::vector<Chunk>& chunks);

/// Writes plans/ID-chunk.sh, which runs the chunk that is its argument with the settings of this process, and returns
/// its path.
std::filesystem::path write_chunk_script(const ClusterPlan& plan, const ClusterProfile& profile);
/// The command that makes tables and report from the rows that are there.
std::string gather_command(const ClusterPlan& plan);

/// Writes a script for GNU parallel, and returns the command that starts it.
std::string emit_parallel(const ClusterPlan& plan);
/// Writes a Snakefile, and returns the command that starts it.
std::string emit_snakemake(const ClusterPlan& plan, const ClusterProfile& profile);

}  // namespace marrow::cli
