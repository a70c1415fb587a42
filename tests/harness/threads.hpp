// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <oneapi/tbb/global_control.h>

#include <cstddef>

namespace marrow::test {

/// What `function` returns if the process has this many threads at most.
template <class Function>
auto with_threads(std::size_t threads, const Function& function) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  return function();
}

}  // namespace marrow::test
