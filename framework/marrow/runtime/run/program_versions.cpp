// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/program_versions.hpp"

#include <map>
#include <mutex>
#include <optional>

#include "marrow/base/error.hpp"
#include "marrow/base/file_state.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/runtime/process/program.hpp"

namespace marrow {
namespace {

constexpr double kVersionLimit_s = 120;  // a program in Python may load large libraries first

std::string asked(const std::vector<std::string>& command) {
  const TemporaryFolder folder(new_temporary_folder("version"));
  const ProgramCall call{command, folder.path(), kVersionLimit_s, 0, {}};
  const ProgramEnd end = run_program(call);
  if (const std::string fault = failure_of_program(call, end); !fault.empty()) throw Error("version_command: " + fault);
  const std::size_t last = end.printed.find_last_not_of(" \t\r\n");
  if (last == end.printed.npos)
    throw Error("version_command: the program " + in_quotes(command[0]) +
                " printed nothing; name a command that prints the program's version");
  return end.printed.substr(0, last + 1);
}

}  // namespace

bool asks_for_version(const OptionInfo& option) {
  return option.name == "version_command" && option.type == OptionType::texts;
}

std::string version_printed(const std::vector<std::string>& command) {
  struct Known {
    std::optional<FileState> state;
    std::string printed;
  };
  static std::mutex mutex;
  static std::map<std::vector<std::string>, Known> known;
  if (command.empty()) return "";
  const std::optional<FileState> state = state_of(program_file(command[0]));
  const std::scoped_lock lock(mutex);
  Known& one = known[command];
  if (one.printed.empty() || !(one.state == state)) one = {state, asked(command)};
  return one.printed;
}

std::string version_of_program(const PipelineNode& node) {
  for (std::size_t i = 0; i < node.options.size(); ++i) try {
      if (asks_for_version(node.info.options[i]))
        return version_printed(std::get<std::vector<std::string>>(node.options[i]));
    } catch (const Error&) {  // its calls have failed, and said why
    }
  return "";
}

}  // namespace marrow
