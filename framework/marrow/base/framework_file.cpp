// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/framework_file.hpp"

#include <dlfcn.h>

namespace marrow {

std::filesystem::path framework_file() {
  Dl_info info{};
  dladdr(reinterpret_cast<const void*>(&framework_file), &info);
  return std::filesystem::canonical(info.dli_fname);
}

}  // namespace marrow
