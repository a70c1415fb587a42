// SPDX-License-Identifier: Apache-2.0
#include <new>

namespace {
// Runs while the library is being loaded.
const int kThrow = (throw std::bad_alloc(), 1);
}  // namespace
