// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files beside a plan by which other programs run its chunks. GNU parallel, Snakemake and Slurm interpret the words
// that they pass on: they call shells, and replace braces or percent signs. So they get no paths, only names made of
// the plan's id. Paths are in scripts for /bin/sh, in single quotes.
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
/// Writes plans/ID-gather.sh, which makes tables and report from the existing rows, and returns its path. `more`:
/// further words of the command.
std::filesystem::path write_gather_script(const ClusterPlan& plan, const std::vector<std::string>& more = {});

/// Writes a script for GNU parallel, and returns the command that starts it.
std::string emit_parallel(const ClusterPlan& plan);
/// Writes a Snakefile, and returns the command that starts it.
std::string emit_snakemake(const ClusterPlan& plan, const ClusterProfile& profile);

}  // namespace marrow::cli
