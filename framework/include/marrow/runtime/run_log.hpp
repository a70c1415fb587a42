// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "marrow/runtime/context.hpp"

namespace marrow {

/// The lines that a run leaves. Each goes to the run's file, plain, with its time and level; and to the standard error
/// stream, coloured where that is a terminal. Control characters are written out, and further lines of a text are
/// indented, so that no text can forge a line. Safe to use from several threads.
class RunLog {
 public:
  /// Lines are added at the end of the file, which is there. Throws Error when it cannot be opened.
  explicit RunLog(const std::filesystem::path& file);
  ~RunLog();
  RunLog(const RunLog&) = delete;
  RunLog& operator=(const RunLog&) = delete;

  /// The least level that is shown on the standard error stream; the file takes every line. At first: info.
  void show_from(LogLevel least);
  bool shows(LogLevel level) const;
  /// `where` names the node and the item; empty for a line about the run itself.
  void write(LogLevel level, const std::string& where, const std::string& text);
  /// For the file alone: what was shown otherwise.
  void keep(LogLevel level, const std::string& where, const std::string& text);

  /// Why lines are missing in the file; empty where none are.
  std::string fault() const;

 private:
  struct Loggers;
  std::unique_ptr<Loggers> loggers_;
};

/// "debug", "info", "warning", "error".
const char* level_name(LogLevel level);

}  // namespace marrow
