// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Has the kernel provide the pages of memory that is about to be filled, by several threads at once. For 800 MB this
/// takes a third of the time that the first writes to the memory would take. Does nothing for less than 4 MB, or if the
/// kernel does not support it. The content does not change.
void provide_pages(void* data, std::size_t size);

/// values.resize(count), with the pages provided first.
template <class T>
void resize_large(std::vector<T>& values, std::size_t count) {
  values.reserve(count);
  provide_pages(values.data() + values.size(), (values.capacity() - values.size()) * sizeof(T));
  values.resize(count);
}

}  // namespace marrow
