// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/runtime/catalogue.hpp"
#include "marrow/runtime/diagnostics.hpp"
#include "marrow/runtime/pipeline.hpp"

namespace marrow {

/// A node in place of another one of a pipeline.
struct Fit {
  std::string node;
  std::vector<std::string> missing;  ///< what would have to be wired or given, a line each; with it the node fits
  std::vector<std::string> faults;   ///< why it does not fit
};

/// Every node that could stand in place of node `id`, with the default values of its options: first those of the same
/// kind, fitting or not; then those of other kinds that fit. Faults of the pipeline as it is, and an unknown id, go to
/// `diagnostics`, and the result is empty.
std::vector<Fit> nodes_in_place_of(const std::string& id, const std::filesystem::path& file,
                                   const PipelineArguments& arguments, const Catalogue& catalogue,
                                   Diagnostics& diagnostics);

}  // namespace marrow
