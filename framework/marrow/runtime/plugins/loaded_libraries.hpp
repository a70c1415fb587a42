// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <link.h>

#include <map>
#include <string>
#include <vector>

namespace marrow {

/// What a loaded library says about itself to the loader.
struct DynamicEntries {
  std::string own_name, run_path;
  bool is_inherited = false;  ///< the older kind of run path, which is also searched for what needed libraries need
  std::vector<std::string> needed;
};

DynamicEntries entries_of(const link_map* library);

/// All libraries that are loaded now.
class LoadedLibraries {
 public:
  /// `any`: one of them.
  explicit LoadedLibraries(const link_map* any);
  const std::vector<const link_map*>& in_order() const { return order_; }  ///< of loading
  /// The library that is needed under this name; null if none is loaded.
  const link_map* find(const std::string& name) const;

 private:
  std::vector<const link_map*> order_;
  std::map<std::string, const link_map*> by_name_;
};

}  // namespace marrow
