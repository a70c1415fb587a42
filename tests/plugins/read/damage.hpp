// SPDX-License-Identifier: Apache-2.0
#pragma once
// Faults of files: damaged copies, and texts with one thing wrong. Each is read in a process of its own under a limit
// of memory and time, and must be read, or refused with a sentence that names the file.
#include <sys/resource.h>
#include <sys/wait.h>

#include <cstdio>
#include <functional>
#include <map>
#include <random>
#include <regex>
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
/// seconds, also on a busy machine. `said` becomes the text of the error.
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

/// Reads within this memory, and returns the error. Fails the test unless it names the file.
inline std::string refusal_within_limits(const std::function<void()>& read, const std::string& file_name,
                                         std::size_t limit = 256 << 20) {
  std::string said;
  const Outcome outcome = outcome_of(read, file_name, limit, said);
  EXPECT_EQ(outcome, Outcome::refused) << file_name << ": " << name_of(outcome) << ": " << said;
  return said;
}

#define EXPECT_REFUSED(read, file_name, text)                                                                \
  do {                                                                                                       \
    const std::string marrow_said = ::marrow::test::refusal_within_limits([&] { (void)(read); }, file_name); \
    EXPECT_HAS(marrow_said, text);                                                                           \
  } while (false)

/// One thing that is wrong with a good file, and words of the refusal without the folder's name: all of them if they
/// begin with "/FILE". Without `from`, `to` is the whole file.
struct Fault {
  std::string from, to, said;
};

/// The good file is read, and is refused in these words with each of the faults.
inline void expect_faults(const std::filesystem::path& path, const std::string& good, const std::vector<Fault>& faults,
                          const std::function<void(const std::filesystem::path&)>& read,
                          std::size_t limit = 256 << 20) {
  put(path, good);
  EXPECT_EQ(message_of([&] { read(path); }), "");
  for (const auto& [from, to, said] : faults) {
    SCOPED_TRACE("'" + from + "' -> '" + to.substr(0, 200) + "'");
    put(path, from.empty() ? to : with(good, from, to));
    const std::string refusal =
        without_folder(refusal_within_limits([&] { read(path); }, path.filename(), limit), path.parent_path());
    if (said.starts_with("/" + path.filename().string()))
      EXPECT_EQ(refusal, said);
    else
      EXPECT_HAS(refusal, said);
  }
  put(path, good);
}

/// A good file: its bytes, where its header ends, and the lies that it can tell (text or bytes, and what replaces
/// them).
struct Sample {
  std::string name;  ///< of the file to be damaged, inside the folder
  std::string bytes;
  std::size_t header_bytes = 0;
  std::vector<std::pair<std::string, std::string>> lies{};
  bool is_text = false;  ///< a text that is cut off may still be whole
};

struct Damaged {
  std::string how, bytes;
  bool must_be_refused = true;
};

/// What is done to a sample.
struct Damages {
  int cuts = 40, changes = 60;
  bool as_text = false;           ///< changes are also those that a person makes
  std::size_t memory = 64 << 20;  ///< what a reader may reserve: samples unpack to 200 kB, libraries have some MB
  int least_refused = 0;
};

/// One to four bytes of the header with other bits; of a text, also a part left out, inserted, or a letter that means
/// something to YAML.
inline Damaged changed_copy(const Sample& sample, bool as_text, int number, std::mt19937_64& random) {
  Damaged copy{"changed", sample.bytes, false};
  if (as_text && number % 2) {
    const std::size_t at = random() % sample.bytes.size();
    copy.how += " in way " + std::to_string(number % 6) + " at " + std::to_string(at);
    if (number % 6 == 1)
      copy.bytes.erase(at, 1 + random() % 5);
    else if (number % 6 == 3)
      copy.bytes[at] = ":-[]{}#&*!|>'\"%@`\t\n0x~"[random() % 22];
    else
      copy.bytes.insert(at, sample.bytes.substr(random() % sample.bytes.size(), random() % 12));
    return copy;
  }
  for (int count = 1 + number % 4; count > 0; --count) {
    const std::size_t at = random() % sample.header_bytes;
    const char mask = char(random() % 255 + 1);
    copy.bytes[at] = char(copy.bytes[at] ^ mask);
    copy.how += " " + std::to_string(at) + "^" + std::to_string(std::uint8_t(mask));
  }
  return copy;
}

/// Cut off, changed, with each of its lies, and replaced by what is no such file.
inline std::vector<Damaged> damaged_copies(const Sample& sample, const Damages& damages) {
  std::mt19937_64 random(sample.bytes.size() * 31 + sample.name.size());
  const std::size_t size = sample.bytes.size();
  std::vector<std::size_t> ends;
  for (const double part : {0.01, 0.1, 0.5, 0.9, 0.99}) ends.push_back(std::size_t(double(size) * part));
  for (int i = 0; i < damages.cuts; ++i)  // half of them anywhere, half where the header is
    ends.push_back(random() % (i % 2 ? std::max<std::size_t>(sample.header_bytes, 1) : size));
  std::vector<Damaged> copies{{"empty", ""},
                              {"text", "this is a text, not what the name says\n"},
                              {"zeros", std::string(4096, '\0')},
                              {"the second half alone", sample.bytes.substr(size / 2)},
                              {"its first 200 bytes scrambled", sample.bytes}};
  for (std::size_t i = 0; i < std::min<std::size_t>(size, 200); ++i)
    copies.back().bytes[i] = char(sample.bytes[i] ^ char(i * 37 + 11));
  for (const std::size_t end : ends)
    copies.push_back({"cut off at " + std::to_string(end) + " of " + std::to_string(size), sample.bytes.substr(0, end),
                      !sample.is_text});
  for (int i = 0; i < damages.changes; ++i) copies.push_back(changed_copy(sample, damages.as_text, i, random));
  for (const auto& [from, to] : sample.lies) copies.push_back({"a lie: " + to, with(sample.bytes, from, to)});
  return copies;
}

/// Reads damaged copies in a folder that may hold other, good files.
inline void expect_handled(const TemporaryFolder& folder, const Sample& sample,
                           const std::function<void(const std::filesystem::path&)>& read, const Damages& damages = {}) {
  std::map<Outcome, int> counts;
  const std::filesystem::path path = folder / sample.name;
  put(path, sample.bytes);
  EXPECT_EQ(message_of([&] { read(path); }), "") << sample.name << " as it was";
  std::string said;
  EXPECT_EQ(outcome_of([&] { read(path); }, path.filename(), damages.memory, said), Outcome::accepted) << said;
  for (const Damaged& copy : damaged_copies(sample, damages)) {
    put(path, copy.bytes);
    const Outcome outcome = outcome_of([&] { read(path); }, path.filename(), damages.memory, said);
    ++counts[outcome];
    EXPECT_TRUE(outcome == Outcome::refused || (outcome == Outcome::accepted && !copy.must_be_refused))
        << sample.name << ", " << copy.how << ": " << name_of(outcome) << ": " << said;
    EXPECT_FALSE(std::regex_search(without_folder(said, folder.path()), std::regex("0x[0-9a-f]{6}"))) << said;
    EXPECT_EQ(said.find("std::"), std::string::npos) << said;
  }
  EXPECT_GE(counts[Outcome::refused], damages.least_refused) << sample.name;
  put(path, sample.bytes);
  std::printf("%-24s %3d refused, %3d read\n", sample.name.c_str(), counts[Outcome::refused],
              counts[Outcome::accepted]);
}

}  // namespace marrow::test
