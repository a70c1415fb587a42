// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace MARROW_EXPORT marrow {

/// Calls use(name of the output, item, value) for each single value of this type among the outputs of a run. `item` is
/// its place along the axes ("distal/final"; empty outside lists). What the run did not make is left out.
void for_each_item(const Pipeline& pipeline, const RunResult& result, const TypeInfo& type,
                   const std::function<void(const std::string&, const std::string&, const Value&)>& use);

}  // namespace marrow
