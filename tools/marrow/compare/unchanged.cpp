// SPDX-License-Identifier: Apache-2.0
#include "compare/unchanged.hpp"

#include "marrow/domain/error.hpp"
#include "runtime/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& what) {
  throw Error(what + " was changed while the comparison ran: its tables may mix the old with the new; give the same "
                     "command again, which runs again what that concerns");
}

}  // namespace

Unchanged::Unchanged(const compare::Experiment& experiment)
    : experiment_(experiment), texts_{{experiment.file, experiment.text}} {
  for (const fs::path& file : {experiment.pipeline, experiment.simulation.pipeline})
    if (!file.empty()) texts_[file] = read_text_file(file, kMostSourceBytes);
}

void Unchanged::check(const compare::Dependencies& dependencies) const {
  for (const auto& [file, text] : texts_)
    if (read_text_file(file, kMostSourceBytes) != text) refuse(file.string());
  const Catalogue catalogue;
  const std::string change = compare::first_change(dependencies, catalogue);
  if (!change.empty()) refuse(change);
}

}  // namespace marrow::cli
