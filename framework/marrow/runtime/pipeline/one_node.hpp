// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace MARROW_EXPORT marrow {

/// A pipeline of one node, and the values of its inputs. run_pipeline() runs it with `given` as RunSettings::given.
struct OneNode {
  Pipeline pipeline;  ///< its last node is called; its outputs have the names of the node's outputs
  std::map<std::string, std::vector<Value>> given;
};

/// Makes a pipeline that calls the node `name`, for a program that has the node's inputs in memory. Each of `inputs`
/// has the name of a port. If a port takes one item and gets a list, the node is called for each item, as in any
/// pipeline. Each of `options` has a name and its value as in given_value(). Relative paths start at the working
/// folder. All faults go to `diagnostics`. The result may be used only if there are none. The place of a fault has no
/// line: Place::file is "kind.name(port or option)".
OneNode pipeline_of_node(const std::string& name, const std::vector<std::pair<std::string, Value>>& inputs,
                         const std::vector<std::pair<std::string, std::string>>& options, const Catalogue& catalogue,
                         Diagnostics& diagnostics);

}  // namespace marrow
