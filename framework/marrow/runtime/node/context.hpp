// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "marrow/base/error.hpp"

namespace MARROW_EXPORT marrow {

/// How important a line of the log is. Nodes throw errors instead of logging them.
enum class LogLevel { debug, info, warning, error };

/// What the runtime gives a node besides its inputs. A node takes it as an argument `Context&`. Safe to use from
/// several threads of the node. A default-constructed one (for tests) is never cancelled and reports nothing.
class Context {
 public:
  struct Hooks {
    std::uint64_t seed = 0;
    const std::atomic<bool>* cancelled = nullptr;
    std::function<void(double fraction, std::string_view what)> progress;
    std::function<void(std::string_view message, LogLevel level)> log;
  };
  Context() = default;
  explicit Context(std::uint64_t seed) { hooks_.seed = seed; }
  explicit Context(Hooks hooks) : hooks_(std::move(hooks)) {}

  /// The only source of randomness. It is made from the run's seed and all inputs and options of the node. So two nodes
  /// with the same recipe draw the same numbers. A node that uses it must be declared with .random().
  std::uint64_t seed() const { return hooks_.seed; }
  /// Throws Cancelled after Ctrl-C. Call it inside long loops.
  void check_cancelled() const {
    if (hooks_.cancelled && hooks_.cancelled->load(std::memory_order_relaxed)) throw Cancelled();
  }
  /// Reports the progress of a long call, from 0 to 1.
  void progress(double fraction, std::string_view what = {}) const {
    if (hooks_.progress) hooks_.progress(fraction, what);
  }
  /// Writes a line to the run's log. The runtime adds the names of the node and the item, so the text need not contain
  /// them.
  void log(LogLevel level, std::string_view message) const {
    if (hooks_.log) hooks_.log(message, level);
  }
  void debug(std::string_view message) const { log(LogLevel::debug, message); }
  void info(std::string_view message) const { log(LogLevel::info, message); }
  /// Reports what a person should know about the result. The warning is kept with the result and repeated when the
  /// result is read back.
  void warn(std::string_view message) const { log(LogLevel::warning, message); }

 private:
  Hooks hooks_;
};

/// A parser must call this before it reads a file. If the process then crashes or is killed, the message names that
/// file. Has an effect only in a process that was started to read files. Safe to use from several threads.
void now_reading(const std::filesystem::path& file);

}  // namespace marrow
