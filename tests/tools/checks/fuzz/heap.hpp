// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

namespace marrow::fuzz {

/// From now on the process may hold so many bytes more on its heap than it holds now; what asks for more ends it, by
/// `exceeded`. Counts what malloc() gives, to all libraries; nothing under a sanitizer, which has a heap of its own.
void limit_heap(std::size_t more_bytes, void (*exceeded)());

/// The most bytes that were held since then.
std::size_t heap_peak();

}  // namespace marrow::fuzz
