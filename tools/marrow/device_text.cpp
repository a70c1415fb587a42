// SPDX-License-Identifier: Apache-2.0
#include "device_text.hpp"

#include <dlfcn.h>

#include <algorithm>

namespace marrow::cli {

std::string device_text(const std::string& node, const Catalogue& catalogue) {
  const std::vector<std::string>& traits = catalogue.find(node)->traits;
  if (std::find(traits.begin(), traits.end(), "device") == traits.end()) return "";
  catalogue.load(node);
  const std::filesystem::path file = std::filesystem::canonical(catalogue.library_of(node)->file);
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NOLOAD);
  const auto ask = library ? reinterpret_cast<const char* (*)()>(dlsym(library, "marrow_device")) : nullptr;
  return ask ? ask() : "it does not say which device is there: its library has no function marrow_device";
}

}  // namespace marrow::cli
