// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

namespace marrow::fuzz {

/// From now on, the heap of the process may grow by this many bytes; an allocation beyond that ends the process by
/// `exceeded`. Counts malloc() of all libraries. Does nothing under a sanitizer, which has its own heap.
void limit_heap(std::size_t more_bytes, void (*exceeded)());

/// The largest growth since then, in bytes.
std::size_t heap_peak();

}  // namespace marrow::fuzz
