// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>

namespace marrow::python {

/// Does the work on a thread of its own, without Python's lock, and waits for its end. If Python gets a signal
/// meanwhile (Ctrl-C) and its handler raises an exception, `cancelled` becomes true; the exception goes on when the
/// work has ended. No signal handler is changed. What the work throws is thrown.
void do_interruptibly(std::atomic<bool>& cancelled, const std::function<void()>& work);

}  // namespace marrow::python
