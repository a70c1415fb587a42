// SPDX-License-Identifier: Apache-2.0
#include <csignal>

namespace {
// Runs while the library is being loaded.
const int kCrash = raise(SIGSEGV);
}  // namespace
