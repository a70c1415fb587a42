// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <set>
#include <string>

#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {

/// Replaces $name in a text by the value of the pipeline's input of that name. $$ stands for a dollar.
class InputTexts {
 public:
  InputTexts(const WrittenPipeline& pipeline, Diagnostics& diagnostics)
      : pipeline_(pipeline), diagnostics_(diagnostics) {}

  /// Returns nothing if a name has no value. This is a fault only if the pipeline does not declare an input of that
  /// name.
  std::optional<std::string> put_into(const std::string& text, const Place& place);

  std::set<std::string> used, unknown;  ///< names found so far

 private:
  const std::string* value_of(const std::string& name, const Place& place);

  const WrittenPipeline& pipeline_;
  Diagnostics& diagnostics_;
  std::size_t bytes_ = 0;  ///< of all values put in so far
};

}  // namespace marrow
