// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/export.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"

namespace MARROW_EXPORT marrow {

/// A node that may replace another node of a pipeline.
struct Fit {
  std::string node;                  ///< kind.name
  std::vector<std::string> missing;  ///< what must be wired or given so that the node fits, one line each
  std::vector<std::string> faults;   ///< why it does not fit
};

/// The nodes that could replace node `id`, with the default values of their options: all nodes of the same kind, even
/// if they do not fit, and then the nodes of other kinds that fit. If the pipeline itself has faults or `id` is
/// unknown, this goes to `diagnostics`, and the result is empty.
std::vector<Fit> nodes_in_place_of(const std::string& id, const std::filesystem::path& file,
                                   const PipelineArguments& arguments, const Catalogue& catalogue,
                                   Diagnostics& diagnostics);

}  // namespace marrow
