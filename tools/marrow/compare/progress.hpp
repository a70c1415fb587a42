// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <cstddef>
#include <string>

namespace marrow::cli {

/// Shows the progress of work with many parts on the standard error: one line that changes on a terminal, otherwise a
/// line at the beginning, every five seconds and at the end.
class Progress {
 public:
  /// `what` names the parts in the first line: "0 of 240 cells".
  Progress(std::size_t all, const std::string& what, bool quiet);
  /// One more part is done, `what`.
  void add(const std::string& what) { done(number_ + 1, what); }
  /// `number` parts are done; `what` is the last of them.
  void done(std::size_t number, const std::string& what);

 private:
  std::size_t all_, number_ = 0;
  bool quiet_, is_terminal_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), last_ = start_;
};

}  // namespace marrow::cli
