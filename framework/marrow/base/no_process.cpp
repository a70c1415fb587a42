// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/no_process.hpp"

#include <atomic>

namespace marrow {
namespace {

std::atomic<long> calls{0};

}  // namespace

long calls_without_process() { return calls; }
void note_call_without_process() { ++calls; }

}  // namespace marrow
