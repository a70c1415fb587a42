// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/user_folder.hpp"

#include <pwd.h>
#include <unistd.h>

#include <cstdlib>
#include <vector>

namespace marrow {
namespace {

namespace fs = std::filesystem;

fs::path absolute_path_in(const char* variable) {
  const char* text = std::getenv(variable);
  return text && fs::path(text).is_absolute() ? fs::path(text) : fs::path();
}

/// Calls use(entry) with what the system knows about a user, if it knows the user.
template <class Use>
void look_up(uid_t user, const Use& use) {
  std::vector<char> text(16384);
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(user, &entry, text.data(), text.size(), &found) == 0 && found) use(*found);
}

}  // namespace

fs::path user_cache_folder() {
  if (fs::path cache = absolute_path_in("XDG_CACHE_HOME"); !cache.empty()) return cache;
  fs::path home = absolute_path_in("HOME");
  if (home.empty())
    look_up(geteuid(), [&](const passwd& entry) {
      if (entry.pw_dir && fs::path(entry.pw_dir).is_absolute()) home = entry.pw_dir;
    });
  return home.empty() ? home : home / ".cache";
}

std::string user_name(unsigned user) {
  std::string name = "user " + std::to_string(user);
  look_up(user, [&](const passwd& entry) {
    if (entry.pw_name) name = entry.pw_name;
  });
  return name;
}

}  // namespace marrow
