// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/process_tree.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>
#include <sstream>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/hash.hpp"
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

constexpr std::size_t kDigits = 16;      // of the digest
constexpr std::size_t kMostOfName = 24;  // characters of the host's name that are shown; the digest has all of it

/// What /proc says about a process of this namespace.
struct Stat {
  char state = '?';
  unsigned long long start = 0;  ///< clock ticks after the boot
};

/// Nothing if /proc is missing or shows the processes of another namespace, whose numbers mean other processes.
std::optional<Stat> stat_of(pid_t process) {
  std::error_code error;
  if (fs::read_symlink("/proc/self", error) != formatted("{}", getpid()) || error) return std::nullopt;
  std::ifstream file(formatted("/proc/{}/stat", process));
  std::string text;
  std::getline(file, text);
  const std::size_t name_end = text.rfind(')');  // the program's name may have spaces
  if (name_end == std::string::npos) return std::nullopt;
  std::istringstream fields(text.substr(name_end + 1));
  Stat stat;
  fields >> stat.state;
  std::string skipped;
  for (int field = 4; field < 22; ++field) fields >> skipped;  // proc(5): the start is the 22nd
  if (!(fields >> stat.start)) return std::nullopt;
  return stat;
}

std::string first_line(const char* file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

/// Names the host, its boot and the namespaces of this process.
std::string place_of_processes() {
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host.fill('\0');
  Hasher hasher;
  hasher.add(std::string(host.data()));
  hasher.add(first_line("/proc/sys/kernel/random/boot_id"));
  for (const char* space : {"/proc/self/ns/pid", "/proc/self/ns/time"}) {
    std::error_code error;
    hasher.add(fs::read_symlink(space, error).string());
  }
  std::string name;
  for (const char* at = host.data(); *at && *at != '.' && name.size() < kMostOfName; ++at)
    if (std::isalnum(static_cast<unsigned char>(*at))) name += *at;
  return (name.empty() ? "host" : name) + "." + hasher.digest().hex().substr(0, kDigits);
}

std::string make_identity() {
  const std::optional<Stat> stat = stat_of(getpid());
  return formatted("{}.{:08}.{:012}", place_of_processes(), getpid(), stat ? stat->start : 0ull);
}

/// The parts of an identity.
struct Parts {
  std::string_view place;
  int process = 0;
  unsigned long long start = 0;
};

template <class Number>
bool parse(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

std::optional<Parts> parts_of(std::string_view identity) {
  const std::size_t last = identity.rfind('.');
  const std::size_t middle = last == std::string_view::npos || last == 0 ? last : identity.rfind('.', last - 1);
  if (last == std::string_view::npos || middle == std::string_view::npos || middle == last) return std::nullopt;
  Parts parts{identity.substr(0, middle)};
  if (!parse(identity.substr(middle + 1, last - middle - 1), parts.process) || parts.process <= 0 ||
      !parse(identity.substr(last + 1), parts.start))
    return std::nullopt;
  const std::size_t dot = parts.place.find('.');
  if (dot == 0 || dot == std::string_view::npos) return std::nullopt;
  for (const char one : parts.place.substr(0, dot))
    if (!std::isalnum(static_cast<unsigned char>(one))) return std::nullopt;
  const std::string_view digest = parts.place.substr(dot + 1);
  if (digest.size() != kDigits || digest.find_first_not_of("0123456789abcdef") != std::string_view::npos)
    return std::nullopt;
  return parts;
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

const std::string& this_process() {
  static std::mutex mutex;
  static pid_t process = 0;
  static const std::string* identity = nullptr;  // never deleted: a caller may still use an older one
  const std::scoped_lock lock(mutex);
  if (process != getpid()) {  // at first, and after a fork
    process = getpid();
    identity = new std::string(make_identity());
  }
  return *identity;
}

bool is_identity(std::string_view text) { return parts_of(text).has_value(); }

Life life_of(std::string_view identity) {
  const std::string& own = this_process();
  if (identity == own) return Life::lives;
  const std::optional<Parts> parts = parts_of(identity), here = parts_of(own);
  if (!parts || !here || parts->place != here->place) return Life::unknown;
  if (kill(parts->process, 0) != 0 && errno == ESRCH) return Life::ended;
  const std::optional<Stat> stat = stat_of(parts->process);
  if (!stat || parts->start == 0) return Life::unknown;
  return stat->start != parts->start || stat->state == 'Z' ? Life::ended : Life::lives;
}

SpawnAttributes::SpawnAttributes() {
  posix_spawnattr_init(&attributes_);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes_, &none);
  posix_spawnattr_setsigdefault(&attributes_, &all);
  posix_spawnattr_setpgroup(&attributes_, 0);
  posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
}

}  // namespace marrow
