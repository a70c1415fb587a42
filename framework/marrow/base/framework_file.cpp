// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/framework_file.hpp"

#include <dlfcn.h>
#include <pwd.h>
#include <unistd.h>
#include <cstdlib>
#include <vector>

#include "marrow/base/number_text.hpp"

namespace marrow {

std::filesystem::path framework_file() {
  Dl_info info{};
  dladdr(reinterpret_cast<const void*>(&framework_file), &info);
  return std::filesystem::canonical(info.dli_fname);
}

namespace {

namespace fs = std::filesystem;

fs::path absolute_path_in(const char* variable) {
  const char* text = std::getenv(variable);
  return text && fs::path(text).is_absolute() ? fs::path(text) : fs::path();
}

}  // namespace

std::optional<User> user_of(uid_t id) {
  std::vector<char> text(16384);
  passwd entry{}, *found = nullptr;
  if (getpwuid_r(id, &entry, text.data(), text.size(), &found) != 0 || !found) return std::nullopt;
  const fs::path home = found->pw_dir ? found->pw_dir : "";
  return User{found->pw_name ? found->pw_name : "", home.is_absolute() ? home : fs::path(), found->pw_gid};
}

std::string user_name(uid_t id) {
  const std::optional<User> user = user_of(id);
  return user && !user->name.empty() ? user->name : formatted("user {}", id);
}

fs::path user_cache_folder() {
  if (fs::path cache = absolute_path_in("XDG_CACHE_HOME"); !cache.empty()) return cache;
  fs::path home = absolute_path_in("HOME");
  if (home.empty()) home = user_of(geteuid()).value_or(User()).home;
  return home.empty() ? home : home / ".cache";
}

}  // namespace marrow
