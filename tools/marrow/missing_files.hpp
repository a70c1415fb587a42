// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/diagnostics.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow::cli {

/// A fault for each file or folder that a needed node would read and that is not there, at the place that names it.
/// Nodes that may fail are left out. Where a file names further files, its node has the trait `names_files`: it is
/// called, in a process of its own, and its refusal is the fault. That needs `inputs_are_given`: all inputs of the
/// pipeline have values.
Diagnostics faults_of_files(const Pipeline& pipeline, const Catalogue& catalogue, bool inputs_are_given);

}  // namespace marrow::cli
