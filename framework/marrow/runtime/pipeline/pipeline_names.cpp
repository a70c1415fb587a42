// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_names.hpp"

#include <fstream>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"

namespace marrow {

std::string suggested(const Diagnostics& diagnostics, const std::string& wrong, const std::vector<std::string>& known) {
  return diagnostics.is_full() ? "" : suggestion(wrong, known);
}

std::string suggested_for(const std::string& node, const std::string& wrong, const std::vector<std::string>& known,
                          const Diagnostics& diagnostics) {
  if (diagnostics.is_full()) return "";
  for (const std::filesystem::path& folder : Catalogue::default_folders()) {
    std::ifstream file(folder / "renamed.txt");
    for (std::string since, of, old, now; file >> since >> of >> old >> now;)
      if (old == wrong && contains(known, now) && (of == node || node.starts_with(of + ".")))
        return in_quotes(old) + " is called " + in_quotes(now) + " since " + since;
  }
  return suggestion(wrong, known);
}

}  // namespace marrow
