// SPDX-License-Identifier: Apache-2.0
#include "nodes.hpp"

#include "marrow/plugin.hpp"
#include "target.hpp"

namespace marrow::fuzz {

const Catalogue& nodes() {
  // Described here: this build may have no program that does it. The library's constructors are ours.
  static const Catalogue known = [] {
    LibraryInfo info;
    info.file = folder() / "plugins" / "marrow_test_numbers.so";
    std::filesystem::create_directories(info.file.parent_path());
    std::filesystem::copy_file(MARROW_FUZZ_PLUGIN, info.file);
    info.digest = file_digest(info.file);
    for (const NodeDefinition& node : load_library(info.file)->nodes) info.nodes.push_back(node.info);
    write_manifest(info);
    return Catalogue({info.file.parent_path()});
  }();
  return known;
}

}  // namespace marrow::fuzz
