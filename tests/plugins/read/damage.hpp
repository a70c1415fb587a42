// SPDX-License-Identifier: Apache-2.0
#pragma once
// Damaged copies of a file, each read in a process of its own under a limit of memory and time.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tests/plugins/read/files.hpp"

namespace marrow::test {

enum class Outcome { refused, accepted, unnamed, out_of_memory, other_exception, crashed };

inline const char* name_of(Outcome outcome) {
  static constexpr const char* kNames[] = {"refused",       "accepted",          "an error that does not name the file",
                                           "out of memory", "another exception", "crashed or too long"};
  return kNames[int(outcome)];
}

inline std::size_t address_space_bytes() {
  std::ifstream stream("/proc/self/statm");
  std::size_t pages = 0;
  stream >> pages;
  return pages * std::size_t(::sysconf(_SC_PAGESIZE));
}

/// The outcome of reading in a process of its own. It may reserve only `limit` more bytes than it has, and has 60
/// seconds. `said` becomes the text of the error.
inline Outcome outcome_of(const std::function<void()>& read, const std::string& file_name, std::size_t limit,
                          std::string& said) {
  int channel[2];
  if (::pipe(channel) != 0) throw std::runtime_error("no pipe");
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    const rlim_t most = address_space_bytes() + limit;
    const rlimit memory{most, most}, no_core{0, 0};
    ::setrlimit(RLIMIT_AS, &memory);
    ::setrlimit(RLIMIT_CORE, &no_core);
    ::alarm(60);
    Outcome outcome = Outcome::accepted;
    std::string text;
    try {
      read();
    } catch (const Error& error) {
      text = error.what();
      outcome = text.find(file_name) == std::string::npos ? Outcome::unnamed : Outcome::refused;
    } catch (const std::bad_alloc&) {
      outcome = Outcome::out_of_memory;
    } catch (const std::exception& error) {
      text = error.what();
      outcome = Outcome::other_exception;
    }
    text.resize(std::min<std::size_t>(text.size(), 4000));
    if (::write(channel[1], text.data(), text.size()) < 0) ::_exit(int(Outcome::crashed));
    ::_exit(int(outcome));
  }
  ::close(channel[1]);
  said.clear();
  char buffer[4096];
  for (ssize_t count; (count = ::read(channel[0], buffer, sizeof buffer)) > 0;) said.append(buffer, std::size_t(count));
  ::close(channel[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) < int(Outcome::crashed) ? Outcome(WEXITSTATUS(status))
                                                                          : Outcome::crashed;
}

/// A good file: its bytes, where its header ends, and the lies that it can tell (text or bytes, and what replaces
/// them).
struct Sample {
  std::string name;  ///< of the file to be damaged, inside the folder
  std::string bytes;
  std::size_t header_bytes = 0;
  std::vector<std::pair<std::string, std::string>> lies;
  bool is_text = false;  ///< a text that is cut off may still be whole
};

struct Damaged {
  std::string how, bytes;
  bool must_be_refused = true;
};

inline std::vector<Damaged> damaged_copies(const Sample& sample, int cuts, int flips) {
  std::mt19937_64 random(sample.bytes.size() * 31 + sample.name.size());
  std::vector<Damaged> copies;
  for (int i = 0; i < cuts; ++i) {
    // Half of the cuts anywhere, half where the header is.
    const std::size_t end = i % 2 ? std::max<std::size_t>(sample.header_bytes, 1) : sample.bytes.size();
    const std::size_t at = random() % end;
    copies.push_back({"cut off at " + std::to_string(at) + " of " + std::to_string(sample.bytes.size()),
                      sample.bytes.substr(0, at), !sample.is_text});
  }
  for (int i = 0; i < flips; ++i) {
    Damaged copy{"flipped", sample.bytes, false};
    for (int count = 1 + i % 4; count > 0; --count) {
      const std::size_t at = random() % sample.header_bytes;
      const char mask = char(random() % 255 + 1);
      copy.bytes[at] = char(copy.bytes[at] ^ mask);
      copy.how.append(" ").append(std::to_string(at)).append("^").append(std::to_string(std::uint8_t(mask)));
    }
    copies.push_back(std::move(copy));
  }
  for (const auto& [from, to] : sample.lies) {
    const std::size_t at = sample.bytes.find(from);
    EXPECT_NE(at, std::string::npos) << sample.name << " has no " << from;
    if (at == std::string::npos) continue;
    std::string bytes = sample.bytes;
    Damaged copy{"a lie: ", bytes.replace(at, from.size(), to), true};
    copy.how += to;
    copies.push_back(std::move(copy));
  }
  return copies;
}

}  // namespace marrow::test
