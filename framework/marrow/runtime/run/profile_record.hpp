// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <map>
#include <mutex>
#include <set>
#include <tuple>
#include <vector>

#include "marrow/runtime/run/profile.hpp"

namespace marrow {

/// What a profile keeps: bars, sums by name, and samples of processor time. Times in ns since it was made.
struct Profile::Record {
  struct Name {
    Kind kind;
    std::string node, what;
  };
  struct Kept {
    std::size_t name;
    pid_t row;  ///< the thread's number, or one of `rows`
    std::int64_t begin_ns, length_ns, thread_ns;
    std::size_t item = 0;
  };
  /// `own_ns` and `own_thread_ns` are without the bars inside, on the same thread. `process_ns` is the processor time
  /// of all threads meanwhile.
  struct Sum {
    std::int64_t calls = 0, length_ns = 0, own_ns = 0, own_thread_ns = 0, process_ns = 0;
  };
  struct Sample {
    std::int64_t at_ns;
    std::map<pid_t, std::int64_t> thread_ns;
  };

  std::int64_t ns_of(Clock::time_point time) const {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(time - start).count();
  }
  std::int64_t now_ns() const { return ns_of(Clock::now()); }
  std::size_t name_of(Kind kind, const std::string& node, const std::string& what);
  pid_t row_of(const std::string& row);
  void add(Kept bar, Kind kind, std::string item, const Sum& sum);
  void sample();
  std::size_t left_out() const;
  std::string text(const std::string& title) const;

 private:
  std::map<pid_t, std::string> names_of_rows() const;

  const Clock::time_point start = Clock::now();
  mutable std::mutex mutex;
  std::vector<Name> names;
  std::map<std::tuple<Kind, std::string, std::string>, std::size_t> index_of_name;
  std::vector<std::string> items{""};
  std::map<std::string, std::size_t> index_of_item{{"", 0}};
  std::map<std::string, pid_t> rows;
  std::vector<pid_t> threads;  ///< in the order of their first bars
  std::set<pid_t> known_threads;
  std::vector<Kept> bars;
  std::vector<Sum> sums;  ///< by name
  std::size_t function_bars = 0, missing_bars = 0;
  std::vector<Sample> samples;
  std::int64_t interval_ns = 100'000'000;
};

/// "0007/lateral"
std::string place_of_item(const ProfilePlace& place, std::string_view item);

}  // namespace marrow
