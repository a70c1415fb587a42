// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <set>
#include <string>

#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {

/// Replaces $name in a text by the value of the pipeline's input of that name, and $env:NAME by the environment
/// variable NAME. $$ stands for a dollar.
class InputTexts {
 public:
  InputTexts(const WrittenPipeline& pipeline, Diagnostics& diagnostics)
      : pipeline_(pipeline), diagnostics_(diagnostics) {}

  /// `inputs`: those of the file that the text is written in; null: none. Returns nothing if a name has no value. This
  /// is a fault only if it is not the name of a declared input.
  std::optional<std::string> put_into(const std::string& text, const Place& place, const DeclaredInputs* inputs);

  std::set<std::string> used, unknown;  ///< names of the pipeline's own inputs that were found so far

 private:
  std::optional<std::string> value_of(const std::string& name, const Place& place, const DeclaredInputs& inputs);

  const WrittenPipeline& pipeline_;
  Diagnostics& diagnostics_;
  std::size_t bytes_ = 0;  ///< of all values put in so far
};

}  // namespace marrow
