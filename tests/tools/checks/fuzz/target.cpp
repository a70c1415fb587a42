// SPDX-License-Identifier: Apache-2.0
#include "target.hpp"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>

namespace marrow::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kPrefix = "marrow-fuzz-";

/// Removes the folders of processes that crashed.
void remove_abandoned(const fs::path& where) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(where, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kPrefix)) continue;
    pid_t process = 0;
    std::from_chars(name.data() + kPrefix.size(), name.data() + name.size(), process);
    if (process > 0 && kill(process, 0) != 0 && errno == ESRCH) fs::remove_all(entry.path(), ignored);
  }
}

struct Folder {
  fs::path path;
  Folder() {
    std::error_code error;
    const fs::path where = fs::is_directory("/dev/shm", error) ? fs::path("/dev/shm") : fs::temp_directory_path();
    remove_abandoned(where);
    path = where / (std::string(kPrefix) + std::to_string(getpid()));
    fs::create_directories(path);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

}  // namespace

const fs::path& folder() {
  static const Folder own;
  return own.path;
}

fs::path put(const std::string& name, std::string_view bytes) {
  const fs::path path = folder() / name;
  int descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (descriptor < 0) {
    fs::create_directories(path.parent_path());
    descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  }
  const bool written = descriptor >= 0 && write(descriptor, bytes.data(), bytes.size()) == ssize_t(bytes.size());
  if (descriptor >= 0) close(descriptor);
  if (!written) throw std::runtime_error("cannot write " + path.string());
  return path;
}

void finding(const std::string& what) {
  std::fprintf(stderr, "finding: %s\n", what.c_str());
  std::abort();
}

char Input::choice(std::string_view letters) {
  if (rest.empty()) return letters[0];
  const char first = rest[0];
  rest.remove_prefix(1);
  return letters.find(first) != std::string_view::npos ? first : letters[std::uint8_t(first) % letters.size()];
}

std::string_view Input::text() {
  const std::size_t end = rest.find('\0');
  const std::string_view text = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return text;
}

}  // namespace marrow::fuzz
