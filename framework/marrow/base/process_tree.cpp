// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/process_tree.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

std::string proc_folder(pid_t process) { return formatted("/proc/{}", process); }

void add_children(pid_t process, std::vector<pid_t>& found) {
  std::error_code error;
  for (fs::directory_iterator at(proc_folder(process) + "/task", error), end; !error && at != end;
       at.increment(error)) {
    std::ifstream children(at->path() / "children");
    for (pid_t child = 0; children >> child;) found.push_back(child);
  }
}

double resident_mb(pid_t process) {
  std::ifstream stream(proc_folder(process) + "/statm");
  double total = 0, resident = 0;
  stream >> total >> resident;
  return resident * double(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Each process counts its part of a page that several share. Returns the resident memory if the system does not tell.
double proportional_mb(pid_t process) {
  std::ifstream stream(proc_folder(process) + "/smaps_rollup");
  for (std::string word; stream >> word;)
    if (double kilobytes = 0; word == "Pss:" && stream >> kilobytes) return 1.024e-3 * kilobytes;
  return resident_mb(process);
}

}  // namespace

void keep_descendants() { prctl(PR_SET_CHILD_SUBREAPER, 1); }

std::vector<pid_t> descendants_of(pid_t process) {
  std::vector<pid_t> found;
  add_children(process, found);
  for (std::size_t i = 0; i < found.size(); ++i) add_children(found[i], found);
  return found;
}

void kill_tree(pid_t process) {
  const std::vector<pid_t> descendants = descendants_of(process);
  kill(process, SIGKILL);
  kill(-process, SIGKILL);
  for (const pid_t one : descendants) kill(one, SIGKILL);
}

double memory_of_tree_mb(pid_t process, double enough_mb) {
  const std::vector<pid_t> descendants = descendants_of(process);
  double sum_mb = resident_mb(process);
  for (const pid_t one : descendants) sum_mb += resident_mb(one);
  if (descendants.empty() || sum_mb <= enough_mb) return sum_mb;
  sum_mb = proportional_mb(process);
  for (const pid_t one : descendants) sum_mb += proportional_mb(one);
  return sum_mb;
}

double resident_memory_mb() {
  const Descriptor file(open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
  if (!file.is_open()) return 0;
  char text[100];
  const ssize_t size = read(file, text, sizeof text - 1);
  text[std::max<ssize_t>(size, 0)] = '\0';
  unsigned long resident = 0;
  return std::sscanf(text, "%*u %lu", &resident) == 1 ? double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6 : 0;
}

}  // namespace marrow
