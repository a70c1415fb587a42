// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/large_memory.hpp"

#include <oneapi/tbb/parallel_for.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdint>

#ifndef MADV_POPULATE_WRITE  // glibc 2.34 does not name it yet; kernels before 5.14 refuse it
#define MADV_POPULATE_WRITE 23
#endif

namespace marrow {

void provide_pages(void* data, std::size_t size) {
  constexpr std::size_t kPage = 4096, kLarge = std::size_t(4) << 20, kPart = std::size_t(16) << 20;
  if (size < kLarge) return;
  const std::uintptr_t address = reinterpret_cast<std::uintptr_t>(data);
  const std::uintptr_t begin = (address + kPage - 1) / kPage * kPage, end = (address + size) / kPage * kPage;
  tbb::parallel_for(std::size_t(0), (end - begin + kPart - 1) / kPart, [&](std::size_t part) {
    const std::uintptr_t first = begin + part * kPart;
    madvise(reinterpret_cast<void*>(first), std::min<std::size_t>(kPart, end - first), MADV_POPULATE_WRITE);
  });
}

}  // namespace marrow
