// SPDX-License-Identifier: Apache-2.0
#include "compare/comparison_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMarker = "marrow-comparison";
const std::string kHead =
    "This folder is a comparison of marrow, which changes and removes what is in it.\nexperiment: ";
const std::string kFile = "file: ";

/// What the marker says. An older one has no file.
struct Owner {
  std::string name;
  fs::path file;
};

std::string marker_text(const Owner& owner) {
  return kHead + owner.name + "\n" + (owner.file.empty() ? "" : kFile + owner.file.string() + "\n");
}

/// Nothing if the text is no marker, or if its writer was killed before it was complete. A path may have a line break,
/// a name cannot.
std::optional<Owner> owner_in(const std::string& text) {
  if (!text.starts_with(kHead) || !text.ends_with('\n')) return std::nullopt;
  const std::size_t end = text.find('\n', kHead.size());
  Owner owner{text.substr(kHead.size(), end - kHead.size()), {}};
  const std::string rest = text.substr(end + 1);
  if (rest.empty()) return owner;
  if (!rest.starts_with(kFile)) return std::nullopt;
  owner.file = rest.substr(kFile.size(), rest.size() - kFile.size() - 1);
  return owner;
}

/// Whether the marker names another experiment whose file still exists. A moved experiment keeps its folder. A host
/// that cannot see the old place takes it for moved.
bool is_another(const fs::path& before, const fs::path& now) {
  std::error_code error;
  return !before.empty() && fs::exists(before, error) && !fs::equivalent(before, now, error);
}

// Offsets of the bytes of the marker that are locked. One byte for each cell follows. Locked bytes need not exist.
constexpr long kUse = 0, kText = 1, kCells = 2;

[[noreturn]] void refuse_foreign(const fs::path& folder) {
  throw Error("the folder " + folder.string() +
              " holds something else than a comparison; choose another with --out, or remove it");
}

[[noreturn]] void refuse_unwritable(const fs::path& folder, int reason) {
  throw Error("cannot write to the folder " + folder.string() + ": " + std::strerror(reason) +
              "; choose another with --out");
}

bool holds_only_the_marker(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (at->path().filename() != kMarker) return false;
  return !error;
}

/// Files behind a link do not belong to this comparison, so it must not change or remove them.
void refuse_links(const fs::path& folder, const compare::Experiment& experiment) {
  std::error_code ignored;
  const auto check = [&](const fs::path& place) {
    if (fs::is_symlink(place, ignored))
      throw Error(place.string() +
                  " is a link, behind which nothing is changed; remove it, or choose another folder with --out");
  };
  for (const char* part : {"cells", "pictures", "cases", "report"}) check(folder / part);
  for (const char* part : {"cells", "pictures"}) {
    if (!fs::is_directory(folder / part, ignored)) continue;
    for (const auto& variant : experiment.variants) {
      const fs::path of_variant = folder / part / variant.name;
      check(of_variant);
      if (!fs::is_directory(of_variant, ignored)) continue;
      for (const auto& one : experiment.cases) {
        check(of_variant / one.name);
        if (!fs::is_directory(of_variant / one.name, ignored)) continue;
        for (const auto& start : experiment.starts) check(of_variant / one.name / start.name);
      }
    }
  }
}

/// Removes unfinished tables. They remain if a process is killed while it writes.
void remove_parts(const fs::path& folder) {
  std::error_code error, ignored;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (is_hidden_temporary(at->path()) && at->is_regular_file(ignored)) fs::remove(at->path(), ignored);
}

}  // namespace

bool is_comparison(const fs::path& folder) {
  std::error_code error;
  return fs::is_regular_file(folder / kMarker, error);
}

ComparisonFolder::ComparisonFolder(const fs::path& folder, const compare::Experiment& experiment, Use use)
    : folder_(folder) {
  open_marker();
  check_marker(experiment);
  if (!lock(kUse, use == Use::alone ? F_WRLCK : F_RDLCK, false))
    throw Error("another " + std::string(use == Use::alone ? "comparison or cell" : "comparison") + " is running in " +
                folder.string() + "; wait for it, or choose another folder with --out");
  refuse_links(folder, experiment);
  if (use == Use::alone) remove_parts(folder);
  std::error_code error;
  fs::create_directories(folder / "cells", error);
  if (error)
    throw Error("cannot make the folder " + (folder / "cells").string() + ": " + error.message() +
                "; choose another with --out");
  write_text_file(folder / "experiment.yaml", experiment.text);
}

void ComparisonFolder::take_cell(const std::string& id) {
  if (!lock(kCells + long(hash_of(id).low >> 2), F_WRLCK, false))
    throw Error("the cell " + id + " is being run by another process");
}

/// Creates a new marker only in an empty folder. Several processes may do this at the same time.
void ComparisonFolder::open_marker() {
  const fs::path marker = folder_ / kMarker;
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error)
    throw Error("cannot make the folder " + folder_.string() + ": " + error.message() + "; choose another with --out");
  for (bool is_second_look = false;; is_second_look = true) {
    marker_ = Descriptor(open(marker.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    if (marker_.is_open()) break;
    if (errno == ELOOP || errno == EISDIR || errno == ENXIO) refuse_foreign(folder_);
    if (errno != ENOENT) refuse_unwritable(folder_, errno);
    if (fs::is_empty(folder_, error)) {
      marker_ = Descriptor(open(marker.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
      if (marker_.is_open()) break;
      if (errno != EEXIST) refuse_unwritable(folder_, errno);
    } else if (error) {
      refuse_unwritable(folder_, error.value());
    } else if (is_second_look) {  // at the first look, another process may have been making the marker
      refuse_foreign(folder_);
    }
  }
  struct stat info {};
  if (fstat(marker_, &info) != 0 || !S_ISREG(info.st_mode)) refuse_foreign(folder_);
}

/// Writes the marker if it is new, if its writer was killed before it was complete, or if the experiment was moved.
void ComparisonFolder::check_marker(const compare::Experiment& experiment) {
  std::error_code error;
  const fs::path file = fs::canonical(experiment.file, error);
  const Owner owner{experiment.name, error ? fs::absolute(experiment.file) : file};
  lock(kText, F_WRLCK, true);
  const std::string text = read_marker();
  const std::optional<Owner> before = owner_in(text);
  const std::string advice = ": choose another folder with --out, or remove it";
  if (!before && !((kHead.starts_with(text) || text.starts_with(kHead)) && holds_only_the_marker(folder_)))
    refuse_foreign(folder_);
  if (before && before->name != owner.name)
    throw Error("the folder " + folder_.string() + " holds the comparison of another experiment, '" + before->name +
                "'; this one is '" + owner.name + "'" + advice);
  if (before && is_another(before->file, owner.file))
    throw Error("the folder " + folder_.string() + " holds the comparison of another experiment of the same name, '" +
                owner.name + "', whose file is " + printable(before->file.string()) + "; this one is " +
                printable(owner.file.string()) + advice);
  if (text != marker_text(owner)) write_marker(marker_text(owner));
  lock(kText, F_UNLCK, true);
}

std::string ComparisonFolder::read_marker() const {
  char buffer[20000];  // a name and a path
  const ssize_t count = pread(marker_, buffer, sizeof buffer, 0);
  if (count < 0) throw Error("cannot read " + (folder_ / kMarker).string() + ": " + std::strerror(errno));
  return {buffer, std::size_t(count)};
}

void ComparisonFolder::write_marker(const std::string& text) {
  if (pwrite(marker_, text.data(), text.size(), 0) != ssize_t(text.size()) ||
      ftruncate(marker_, off_t(text.size())) != 0)
    throw Error("cannot write " + (folder_ / kMarker).string() + ": " + std::strerror(errno) + "; is the disk full?");
}

/// False if another process holds the lock. The lock belongs to the open file, not to the process. So it stays if
/// another part of this process opens and closes the marker.
bool ComparisonFolder::lock(long byte, short type, bool wait) {
  struct flock what {};
  what.l_type = type;
  what.l_whence = SEEK_SET;
  what.l_start = off_t(byte);
  what.l_len = 1;
  while (fcntl(marker_, wait ? F_OFD_SETLKW : F_OFD_SETLK, &what) != 0) {
    if (errno == EAGAIN || errno == EACCES) return false;
    if (errno == EINTR) continue;
    std::fprintf(stderr, "marrow: %s cannot be locked (%s); start nothing else in this folder\n",
                 printable((folder_ / kMarker).string()).c_str(), std::strerror(errno));
    return true;
  }
  return true;
}

}  // namespace marrow::cli
