// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <set>
#include <string>

#include "pipeline_text.hpp"

namespace marrow {

/// Puts the values of a pipeline's inputs where texts name them, as $name; $$ is a dollar.
class InputTexts {
 public:
  InputTexts(const WrittenPipeline& pipeline, Diagnostics& diagnostics)
      : pipeline_(pipeline), diagnostics_(diagnostics) {}

  /// Nothing where a name has no value: an unknown one is a fault, one that may still be given is none.
  std::optional<std::string> put_into(const std::string& text, const Place& place);

  std::set<std::string> used, unknown;  ///< names so far

 private:
  const std::string* value_of(const std::string& name, const Place& place);

  const WrittenPipeline& pipeline_;
  Diagnostics& diagnostics_;
  std::size_t bytes_ = 0;  ///< put in so far
};

}  // namespace marrow
