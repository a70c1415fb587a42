// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"

namespace marrow::cli {

/// Throws Error if no file can hold an output: a pipeline that only runs inside the program may have such outputs, but
/// a run into a folder cannot write them.
void expect_files_can_hold(const Pipeline& pipeline, const Catalogue& catalogue);

}  // namespace marrow::cli
