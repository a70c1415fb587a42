// SPDX-License-Identifier: Apache-2.0
// The only file that includes spdlog.
#include "marrow/runtime/run/run_log.hpp"

#include <spdlog/logger.h>
#include <spdlog/sinks/ansicolor_sink.h>
#include <spdlog/sinks/basic_file_sink.h>

#include <mutex>

#include "marrow/base/printable.hpp"

namespace marrow {
namespace {

spdlog::level::level_enum level_of(LogLevel level) {
  static constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::debug, spdlog::level::info,
                                                          spdlog::level::warn, spdlog::level::err};
  return kLevels[int(level)];
}

spdlog::sink_ptr file_sink(const std::filesystem::path& file) try {
  return std::make_shared<spdlog::sinks::basic_file_sink_mt>(file.string());
} catch (const spdlog::spdlog_ex& error) {
  throw Error("cannot write to " + file.string() + ": " + error.what());
}

/// A line as it is shown on the terminal, together with the moving line of a run. The node is in a column; the level is
/// shown if it is above info.
std::string shown_line(LogLevel level, const std::string& where, const std::string& text) {
  const std::string named = level >= LogLevel::warning ? std::string(level_name(level)) + ": " : "";
  if (where.empty()) return "marrow: " + named + printable_lines(text);
  std::string column = printable(where);
  column.resize(std::max<std::size_t>(column.size(), 32), ' ');
  return "  " + column + " " + named + printable_lines(text);
}

}  // namespace

const char* level_name(LogLevel level) {
  static constexpr const char* kNames[] = {"debug", "info", "warning", "error"};
  return kNames[int(level)];
}

struct RunLog::Loggers {
  explicit Loggers(const std::filesystem::path& path)
      : file("file", file_sink(path)),
        terminal("terminal", std::make_shared<spdlog::sinks::ansicolor_stderr_sink_mt>()) {
    file.set_pattern("%Y-%m-%d %H:%M:%S.%e [%l] %v");
    file.set_level(spdlog::level::debug);
    file.flush_on(spdlog::level::debug);
    file.set_error_handler([this, path](const std::string& message) {
      const std::scoped_lock lock(mutex);
      if (fault.empty()) fault = "lines are missing in " + path.string() + ": " + message;
    });
    terminal.set_pattern("%^%v%$");
    terminal.set_level(spdlog::level::info);
    terminal.set_error_handler([](const std::string&) {});  // there is nobody left to tell
  }
  mutable std::mutex mutex;
  std::string fault;
  spdlog::logger file, terminal;
};

RunLog::RunLog(const std::filesystem::path& file) : loggers_(std::make_unique<Loggers>(file)) {}
RunLog::~RunLog() = default;

void RunLog::show_from(LogLevel least) { loggers_->terminal.set_level(level_of(least)); }
bool RunLog::shows(LogLevel level) const { return loggers_->terminal.should_log(level_of(level)); }

void RunLog::write(LogLevel level, const std::string& where, const std::string& text) {
  keep(level, where, text);
  if (shows(level)) loggers_->terminal.log(level_of(level), shown_line(level, where, text));
}

void RunLog::keep(LogLevel level, const std::string& where, const std::string& text) {
  loggers_->file.log(level_of(level), printable_lines(where.empty() ? text : printable(where) + ": " + text));
}

std::string RunLog::fault() const {
  const std::scoped_lock lock(loggers_->mutex);
  return loggers_->fault;
}

}  // namespace marrow
