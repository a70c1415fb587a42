// SPDX-License-Identifier: Apache-2.0

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/process_tree.hpp"
#include "workbench/case_files.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

constexpr const char* kStaging = ".saving-";

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path().filename());
  std::sort(files.begin(), files.end());
  return files;
}

bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (fs::equivalent(a, b, error)) return true;
  const auto size_a = fs::file_size(a, error), size_b = error ? 0 : fs::file_size(b, error);
  if (error || size_a != size_b) return false;
  std::ifstream one(a, std::ios::binary), two(b, std::ios::binary);
  std::vector<char> x(1 << 20), y(1 << 20);
  while (one && two) {
    one.read(x.data(), std::streamsize(x.size()));
    two.read(y.data(), std::streamsize(y.size()));
    if (one.gcount() != two.gcount() || std::memcmp(x.data(), y.data(), std::size_t(one.gcount())) != 0) return false;
  }
  return one.eof() && two.eof();
}

[[noreturn]] void fail() { throw fs::filesystem_error("", std::error_code(errno, std::generic_category())); }

Descriptor opened(const fs::path& file, int flags) {
  Descriptor descriptor(open(file.c_str(), flags | O_CLOEXEC, 0644));
  if (!descriptor.is_open()) fail();
  return descriptor;
}

/// Writes a file or a folder's list of names to the disk, so that it survives a loss of power.
void settle(const Descriptor& place) {
  if (fsync(place) != 0 && errno != EINVAL) fail();  // some file systems cannot
}
void settle(const fs::path& folder) { settle(opened(folder, O_RDONLY)); }

constexpr int kNewFile = O_WRONLY | O_CREAT | O_EXCL;

/// Like fs::copy_file(), which reports a full disk as an input/output error.
void copy_whole(const fs::path& from, const fs::path& to) {
  const Descriptor source = opened(from, O_RDONLY), copy = opened(to, kNewFile);
  std::vector<char> bytes(1 << 20);
  for (;;) {
    const ssize_t count = read(source, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail();
    if (count == 0) return settle(copy);
    if (!write_all(copy, {bytes.data(), std::size_t(count)})) fail();
  }
}

/// The same file under another name, or a copy where the file system has no links.
void link_file(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_hard_link(fs::canonical(from), to, error);
  if (error) copy_whole(from, to);
}

void bring(const PlannedCase::File& file, const fs::path& staging) {
  const fs::path to = staging / file.name;
  const auto bring_one = file.is_new ? copy_whole : link_file;
  fs::create_directories(to.parent_path());
  if (!fs::is_directory(file.from)) {
    if (!fs::exists(to)) bring_one(file.from, to);
    return;
  }
  fs::create_directories(to);
  for (const fs::path& name : files_in(file.from))
    if (!fs::exists(to / name)) bring_one(file.from / name, to / name);
  settle(to);
}

void write_text(const fs::path& to, const std::string& text) {
  const Descriptor file = opened(to, kNewFile);
  if (!write_all(file, text)) fail();
  settle(file);
}

/// Whether the process in a folder's name has ended. If that is unknown, because it runs elsewhere or the host was
/// restarted, it counts as ended after a day. An older marrow wrote only the process's number.
bool is_left_over(const fs::path& folder, const std::string& name) {
  const std::string writer = name.substr(std::strlen(kStaging), name.rfind('-') - std::strlen(kStaging));
  if (is_identity(writer)) {
    std::error_code error;
    const auto written = fs::last_write_time(folder, error);
    const bool is_old = !error && fs::file_time_type::clock::now() - written > std::chrono::hours(24);
    const Life life = life_of(writer);
    return life == Life::ended || (life == Life::unknown && is_old);
  }
  const int process = std::atoi(writer.c_str());
  return process > 0 && kill(process, 0) != 0 && errno == ESRCH;
}

/// Removes folders that a crash left behind. Another host or container may be saving the same case now.
void remove_left_over(const fs::path& place) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(place, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(kStaging) && name.rfind('-') >= std::strlen(kStaging) && is_left_over(entry.path(), name))
      fs::remove_all(entry.path(), error);
  }
}

/// Throws if a file of that name has appeared in the meantime.
void move_new(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return;
  if (errno != EINVAL || fs::exists(fs::symlink_status(to))) fail();
  fs::rename(from, to);  // a file system that does not know the flag
}

/// Moves new files to their places. On an exception, takes back what it has moved.
void move_in(const fs::path& staging, const fs::path& place, const PlannedCase& plan, bool has_landmarks) {
  const fs::path old_landmarks = staging / "landmarks.before";
  std::error_code none;
  std::vector<fs::path> moved;
  bool are_landmarks_changed = false;
  if (fs::exists(place / "landmarks.yaml")) link_file(place / "landmarks.yaml", old_landmarks);
  try {
    for (const PlannedCase::File& file : plan.files)
      if (file.is_new) {
        move_new(staging / file.name, place / file.name);
        moved.push_back(place / file.name);
      }
    settle(place);
    if (has_landmarks)
      fs::rename(staging / "landmarks.yaml", place / "landmarks.yaml");
    else
      fs::remove(place / "landmarks.yaml");  // the last landmark was removed
    are_landmarks_changed = true;
    fs::rename(staging / "case.yaml", place / "case.yaml");
  } catch (...) {
    for (const fs::path& file : moved) fs::remove_all(file, none);
    if (!are_landmarks_changed) throw;  // landmarks.yaml may be from another process that is saving the case
    if (fs::exists(old_landmarks, none))
      fs::rename(old_landmarks, place / "landmarks.yaml", none);
    else
      fs::remove(place / "landmarks.yaml", none);
    throw;
  }
  settle(place);
}

}  // namespace

bool is_same_content(const fs::path& a, const fs::path& b) {
  std::error_code error;
  const bool is_folder = fs::is_directory(a, error);
  if (is_folder != fs::is_directory(b, error)) return false;
  if (!is_folder) return is_same_file(a, b);
  try {
    const auto names = files_in(a);
    return names == files_in(b) && std::all_of(names.begin(), names.end(),
                                               [&](const fs::path& name) { return is_same_file(a / name, b / name); });
  } catch (const fs::filesystem_error&) {
    return false;
  }
}

void write_case_files(const fs::path& place, const PlannedCase& plan, const std::string& case_text,
                      const std::string& landmarks_text, const std::function<void(const fs::path&)>& check) {
  const auto failed = [&](const std::string& why) {
    return Error("the case is not saved, and what was in its folder is as before: " + why);
  };
  fs::path staging;
  std::error_code none;
  const bool was_there = fs::exists(place, none);
  const auto clean = [&] {
    if (!staging.empty()) fs::remove_all(staging, none);
    if (!was_there) fs::remove(place, none);  // only if it is empty
  };
  try {
    fs::create_directories(place);
    remove_left_over(place);
    static std::atomic<int> count = 0;
    staging = place / (formatted("{}{}-{}", kStaging, this_process(), ++count));
    fs::remove_all(staging);
    fs::create_directory(staging);
    for (const PlannedCase::File& file : plan.files) bring(file, staging);
    write_text(staging / "case.yaml", case_text);
    if (!landmarks_text.empty()) write_text(staging / "landmarks.yaml", landmarks_text);
    check(staging);
    move_in(staging, place, plan, !landmarks_text.empty());
    fs::remove_all(staging, none);
  } catch (const fs::filesystem_error& error) {
    clean();
    throw failed(error.code().message() +
                 (error.code() == std::errc::no_space_on_device ? "; make room and try again" : ""));
  } catch (const std::exception& error) {
    clean();
    std::string text = error.what();  // the hidden folder would tell people nothing
    for (std::size_t at; !staging.empty() && (at = text.find(staging.string())) != std::string::npos;)
      text.replace(at, staging.string().size(), place.string());
    throw failed(text);
  }
}

}  // namespace marrow::workbench
