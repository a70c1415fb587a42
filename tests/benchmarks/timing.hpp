// SPDX-License-Identifier: Apache-2.0
#pragma once
// What benchmarks share: how long a piece of work takes, and a short run, by which the tests see that each still works.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>

#include "marrow/runtime/plugins/catalogue.hpp"

namespace timing {

/// Whether everything is to be small and done once: the times then say nothing.
inline bool is_short() { return std::getenv("MARROW_SHORT_BENCHMARK") != nullptr; }
inline int rounds(int usual) { return is_short() ? 1 : usual; }

struct NotBuilt : marrow::Error {
  using Error::Error;
};

/// A node; if its plugin is not built, the benchmark ends with a sentence that says so.
inline const marrow::NodeDefinition& node(const marrow::Catalogue& catalogue, const std::string& name) {
  if (!catalogue.find(name)) throw NotBuilt("this benchmark needs the node " + name + ", whose plugin is not built");
  return catalogue.load(name);
}

/// The exit code of a benchmark: 77, which is a skipped test, if a plugin is not built, and 2 if it fails.
template <class Work>
int exit_code_of(const Work& work) {
  try {
    return work();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return dynamic_cast<const NotBuilt*>(&error) ? 77 : 2;
  }
}

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  /// Of all processors, which other programs on the machine disturb less.
  double processor_s() const { return double(std::clock() - processor_start_) / CLOCKS_PER_SEC; }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::clock_t processor_start_ = std::clock();
};

template <class Work>
double milliseconds(const Work& work) {
  const Stopwatch stopwatch;
  work();
  return 1000 * stopwatch.seconds();
}

inline double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace timing
