// SPDX-License-Identifier: Apache-2.0
#include "interruptible.hpp"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

namespace marrow::python {

namespace py = pybind11;

void do_interruptibly(std::atomic<bool>& cancelled, const std::function<void()>& work) {
  constexpr std::chrono::milliseconds kBetweenLooks(50);
  constexpr int kLooksBeforeNotice = 20;
  std::mutex mutex;
  std::condition_variable end;
  bool is_done = false;
  std::exception_ptr fault;
  std::optional<py::error_already_set> interrupt;
  {
    const py::gil_scoped_release release;
    std::thread thread([&] {
      try {
        work();
      } catch (...) {
        fault = std::current_exception();
      }
      const std::scoped_lock lock(mutex);
      is_done = true;
      end.notify_all();
    });
    std::unique_lock lock(mutex);
    for (int looks = 0; !end.wait_for(lock, kBetweenLooks, [&] { return is_done; });) {
      if (interrupt && ++looks == kLooksBeforeNotice) {
        const py::gil_scoped_acquire acquire;
        PySys_WriteStderr("marrow: stopping; it waits until the node that runs has ended\n");
      }
      if (interrupt) continue;
      lock.unlock();
      {
        const py::gil_scoped_acquire acquire;
        if (PyErr_CheckSignals() != 0) {
          interrupt.emplace();
          cancelled = true;
        }
      }
      lock.lock();
    }
    lock.unlock();
    thread.join();
  }
  if (interrupt) throw py::error_already_set(*interrupt);
  if (fault) std::rethrow_exception(fault);
}

}  // namespace marrow::python
