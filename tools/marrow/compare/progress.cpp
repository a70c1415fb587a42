// SPDX-License-Identifier: Apache-2.0
#include "compare/progress.hpp"

#include <unistd.h>

#include <cstdio>

#include "marrow/base/printable.hpp"

namespace marrow::cli {

Progress::Progress(std::size_t all, const std::string& what, bool quiet)
    : all_(all), quiet_(quiet), is_terminal_(isatty(STDERR_FILENO)) {
  if (!quiet_ && all_) std::fprintf(stderr, "  0 of %zu %s%s", all_, what.c_str(), is_terminal_ ? "" : "\n");
}

void Progress::done(std::size_t number, const std::string& what) {
  number_ = number;
  const auto now = std::chrono::steady_clock::now();
  if (quiet_ || (number < all_ &&
                 now - last_ < (is_terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000))))
    return;
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  std::fprintf(stderr, "%s  %zu of %zu, %.0f s", is_terminal_ ? "\r\033[K" : "", number, all_, seconds);
  if (number) std::fprintf(stderr, ", about %.0f s to go", seconds * double(all_ - number) / double(number));
  std::fprintf(stderr, ": %s%s", printable(what).c_str(), is_terminal_ && number < all_ ? "" : "\n");
}

}  // namespace marrow::cli
