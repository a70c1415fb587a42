// SPDX-License-Identifier: Apache-2.0
#pragma once
// The heap of the process, counted: malloc() of all libraries. Under a sanitizer, which has its own, this does nothing.
#include <malloc.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <limits>

namespace {

std::atomic<std::int64_t> held{0}, start{0}, peak{0};
std::atomic<std::int64_t> most{std::numeric_limits<std::int64_t>::max()};
void (*on_exceeded)() = nullptr;

}  // namespace

namespace marrow::fuzz {

/// From now on, the heap may grow by this many bytes; an allocation beyond that ends the process by `exceeded`.
inline void limit_heap(std::size_t more_bytes, void (*exceeded)()) {
  on_exceeded = exceeded;
  start = held.load();
  peak = held.load();
  most = held + std::int64_t(more_bytes);
}

/// The largest growth since then, in bytes.
inline std::size_t heap_peak() { return std::size_t(peak - start); }

}  // namespace marrow::fuzz

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// The program's own malloc() replaces the C library's, for all libraries that it loads.
extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

namespace {

void check(std::size_t bytes) {
  if (bytes < 4096 && held.load(std::memory_order_relaxed) <= most.load(std::memory_order_relaxed)) return;
  if (bytes <= std::size_t(std::numeric_limits<std::int64_t>::max()) && held + std::int64_t(bytes) <= most) return;
  most = std::numeric_limits<std::int64_t>::max();  // the report needs memory too
  if (on_exceeded) on_exceeded();
}

void* counted(void* memory) {
  if (!memory) return memory;
  const std::int64_t now = held += std::int64_t(malloc_usable_size(memory));
  if (now > peak.load(std::memory_order_relaxed)) peak = now;
  return memory;
}

}  // namespace

void* malloc(std::size_t bytes) {
  check(bytes);
  return counted(__libc_malloc(bytes));
}

void* calloc(std::size_t count, std::size_t each) {
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, each, &bytes)) bytes = std::numeric_limits<std::size_t>::max();
  check(bytes);
  return counted(__libc_calloc(count, each));
}

void* realloc(void* memory, std::size_t bytes) {
  check(bytes);
  const std::int64_t before = memory ? std::int64_t(malloc_usable_size(memory)) : 0;
  void* const larger = __libc_realloc(memory, bytes);
  if (larger || bytes == 0) held -= before;
  return counted(larger);
}

void free(void* memory) {
  if (memory) held -= std::int64_t(malloc_usable_size(memory));
  __libc_free(memory);
}

void* memalign(std::size_t alignment, std::size_t bytes) {
  check(bytes);
  return counted(__libc_memalign(alignment, bytes));
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) { return memalign(alignment, bytes); }

int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  *memory = memalign(alignment, bytes);
  return *memory ? 0 : ENOMEM;
}

}  // extern "C"
#endif
