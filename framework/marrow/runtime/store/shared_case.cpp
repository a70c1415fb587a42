// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/shared_case.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// A name that leads to a file below the folder, and to nothing else.
bool is_inside(const fs::path& name) {
  return !name.empty() && name.is_relative() && name.has_filename() &&
         std::none_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".." || part == "."; });
}

}  // namespace

void pack_case(Archive& out, const Digest& key, const fs::path& folder) {
  std::vector<fs::path> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && !entry.is_symlink()) names.push_back(entry.path().lexically_relative(folder));
  std::sort(names.begin(), names.end());
  EntryDescription description;
  description.key = key;
  description.provenance.node = "simulated case";
  for (const fs::path& name : names) {
    const StoreFile file(folder / name);
    Hasher hasher;
    if (!file.is_open() || !copy_bytes(file, 0, file.size(), hasher))
      throw Error("cannot read " + (folder / name).string());
    Leaf leaf{name.string(), 0, 0, true, hasher.digest(), description.payload, file.size(), "", {}};
    description.payload += leaf.size;
    description.leaves.push_back(std::move(leaf));
  }
  write_description(out, description);
  for (const Leaf& leaf : description.leaves) {
    const StoreFile file(folder / leaf.type);
    if (file.size() != leaf.size || !copy_bytes(file, 0, leaf.size, out))
      throw Error((folder / leaf.type).string() + " changed while it was read");
  }
}

bool unpack_case(const StoreFile& file, const Digest& key, const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);  // of an earlier try
  try {
    const ReadEntry entry = read_entry(file, key);
    for (const Leaf& leaf : entry.description.leaves) {
      if (!is_inside(leaf.type) || !leaf.present || !is_within(leaf, entry)) return false;
      const std::string fault = write_whole(folder / leaf.type, [&](Archive& out) {
        if (!copy_leaf(file, entry, leaf, out)) throw Error("it is not whole");
      });
      if (!fault.empty()) return false;
    }
    return !entry.description.leaves.empty();
  } catch (const Error&) {  // damaged, or not yet whole as this host sees it
    return false;
  }
}

}  // namespace marrow
