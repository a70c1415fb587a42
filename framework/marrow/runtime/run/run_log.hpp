// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "marrow/runtime/node/context.hpp"

namespace MARROW_EXPORT marrow {

/// The log of a run. Each line goes to the log file, as plain text with time and level, and to the standard error
/// stream, in colour if that is a terminal. Control characters are escaped, and further lines of a text are indented,
/// so that no text can forge a line. Safe to use from several threads.
class RunLog {
 public:
  /// Appends lines to the file. Throws Error if it cannot be opened.
  explicit RunLog(const std::filesystem::path& file);
  ~RunLog();
  RunLog(const RunLog&) = delete;
  RunLog& operator=(const RunLog&) = delete;

  /// Sets the lowest level that is shown on the standard error stream; at first it is info. The file gets every line.
  void show_from(LogLevel least);
  bool shows(LogLevel level) const;
  /// `where` names the node and the item. It is empty for a line about the run itself.
  void write(LogLevel level, const std::string& where, const std::string& text);
  /// Writes to the file only. For lines that were shown in another way.
  void keep(LogLevel level, const std::string& where, const std::string& text);

  /// Why lines are missing in the file; empty if none are missing.
  std::string fault() const;

 private:
  struct Loggers;
  std::unique_ptr<Loggers> loggers_;
};

/// "debug", "info", "warning", "error".
const char* level_name(LogLevel level);

}  // namespace marrow
