// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "marrow/domain/error.hpp"

namespace marrow {

/// How much a line of the log matters. An error is what a node throws, so a node itself logs none.
enum class LogLevel { debug, info, warning, error };

/// What the runtime gives a node beside its inputs: take it as an argument `Context&`. Safe to use from several threads
/// of the node. A default-made one (in tests) is never cancelled and keeps silent.
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

  /// The only source of randomness: made from the run's seed and from all that the node was given, so two nodes with
  /// the same recipe draw the same numbers. A node that uses it is declared with .random().
  std::uint64_t seed() const { return hooks_.seed; }
  /// Throws Cancelled after Ctrl-C. Call it inside long loops.
  void check_cancelled() const {
    if (hooks_.cancelled && hooks_.cancelled->load(std::memory_order_relaxed)) throw Cancelled();
  }
  /// Tells how far a long node is, 0 to 1.
  void progress(double fraction, std::string_view what = {}) const {
    if (hooks_.progress) hooks_.progress(fraction, what);
  }
  /// A line for the run's log. It names the node and the item; the text need not.
  void log(LogLevel level, std::string_view message) const {
    if (hooks_.log) hooks_.log(message, level);
  }
  void debug(std::string_view message) const { log(LogLevel::debug, message); }
  void info(std::string_view message) const { log(LogLevel::info, message); }
  /// What a person should know of the result; it is kept with the result and said again when that is read back.
  void warn(std::string_view message) const { log(LogLevel::warning, message); }

 private:
  Hooks hooks_;
};

}  // namespace marrow
