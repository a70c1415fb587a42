// SPDX-License-Identifier: Apache-2.0
#include "command_options.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& expected) {
  throw CLI::ValidationError(option + " is '" + text + "', but must be " + expected);
}

/// Whether the whole text is a number that the type can hold.
template <class T>
bool is_read(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

constexpr std::size_t kLeastRoom = 24;  // a narrower column is hard to read

constexpr std::size_t kShortIndent = 6;  // where there is no room beside the head

/// All bytes but those that continue a character of UTF-8.
std::size_t width_of(const std::string& text) {
  return std::size_t(std::count_if(text.begin(), text.end(), [](unsigned char byte) { return (byte & 0xC0) != 0x80; }));
}

/// The lines of one line of text that may be too long.
std::vector<std::string> broken(const std::string& line, std::size_t room) {
  std::vector<std::string> lines{""};
  std::istringstream words(line);
  for (std::string word; words >> word;) {
    std::string& last = lines.back();
    if (last.empty())
      last = word;
    else if (width_of(last) + 1 + width_of(word) <= room)
      last += " " + word;
    else
      lines.push_back(word);
  }
  return lines;
}

/// The characters in a line of the terminal that the standard output goes to. 0 if it goes elsewhere: then each row is
/// one line, so that other programs can read it.
std::size_t terminal_columns() {
  winsize size{};
  return isatty(STDOUT_FILENO) && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

/// `head` and beside it, from the column `indent` on, `text` in lines of at most `columns` characters, each with a line
/// break at its end. With 0 columns lines are only broken where the text has breaks. Where too little room is left,
/// `text` begins on the next line. Words are not broken.
std::string wrapped_beside(const std::string& head, const std::string& text, std::size_t indent, std::size_t columns) {
  const bool is_narrow = columns != 0 && columns < indent + kLeastRoom;
  const std::size_t margin = is_narrow ? std::min(indent, kShortIndent) : indent;
  std::string result = head;
  if (text.empty()) return result + "\n";
  if (columns != 0 && !head.empty() && (is_narrow || width_of(head) >= margin)) {
    result.erase(result.find_last_not_of(' ') + 1);
    result += "\n" + std::string(margin, ' ');
  } else {
    result += std::string(std::max(margin, width_of(head) + (head.empty() ? 0 : 1)) - width_of(head), ' ');
  }
  std::istringstream lines(text);
  bool is_first = true;
  for (std::string line; std::getline(lines, line);)
    for (const std::string& part :
         columns ? broken(line, columns > margin ? columns - margin : 1) : std::vector<std::string>{line}) {
      result += (is_first ? "" : std::string(margin, ' ')) + part + "\n";
      is_first = false;
    }
  return result;
}

class WrappedHelp : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return row(make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option));
  }
  std::string make_subcommand(const CLI::App* command) const override {
    return row(command->get_name(), command->get_description());
  }
  std::string make_description(const CLI::App* app) const override {
    return wrapped_beside("", app->get_description(), 0, terminal_columns());
  }
  std::string make_footer(const CLI::App* app) const override {
    const std::string text = app->get_footer();
    return text.empty() ? text : wrapped_beside("", text, 0, terminal_columns());
  }

 private:
  std::string row(const std::string& name, const std::string& text) const {
    const std::size_t indent = get_column_width();
    const std::string head = "  " + name;
    if (head.size() < indent || text.empty()) return wrapped_beside(head, text, indent, terminal_columns());
    return head + "\n" + wrapped_beside("", text, indent, terminal_columns());
  }
};

}  // namespace

std::uint64_t whole_number(const std::string& option, const std::string& text, std::uint64_t least,
                           std::uint64_t most) {
  std::uint64_t value = 0;
  const bool has_leading_zero = text.size() > 1 && text[0] == '0';
  if (!is_read(text, value) || has_leading_zero || value < least || value > most)
    refuse(option, text,
           formatted("a whole number from {} to {}{}", least, most,
                     has_leading_zero ? ", in decimal digits without leading zeros" : ""));
  return value;
}

double number(const std::string& option, const std::string& text, double least, double most, const std::string& unit,
              const std::string& end) {
  double value = 0;
  if (!is_read(text, value) || !(value >= least && value <= most))
    refuse(option, text, "a number of " + unit + " from " + exact_number(least) + " to " + exact_number(most) + end);
  return value;
}

CLI::Option* add_amount(CLI::App* command, const std::string& option, double& target, const std::string& unit,
                        const std::string& help) {
  const auto take = [=, &target](const std::string& text) {
    target = number(option, text, kLeastAmount, kMostAmount, unit);
  };
  return command->add_option_function<std::string>(option, take, help)->type_name("NUMBER");
}

void add_pipeline_arguments(CLI::App* command, PipelineRequest& request) {
  command->add_option("pipeline", request.file, "pipeline file (YAML)")->required();
  command->add_option("inputs", request.inputs, "values of the pipeline's inputs, as name=value");
  command
      ->add_option(
          "--set", request.overrides,
          "override, as node.option=value, node.uses=kind.name, node.may_fail=true or node.in.port=reference. A "
          "value is taken as a text; if it begins with [, {, \" or ', it is YAML")
      ->allow_extra_args(false)  // so that an input may follow it
      ->type_name("NODE.OPTION=VALUE");
  command
      ->add_option("--set-file", request.settings,
                   "YAML file with values that differ from machine to machine: {inputs: {name: value}, set: "
                   "{node.option: value}}. Arguments and --set count more")
      ->allow_extra_args(false)
      ->type_name("FILE");
}

void add_file_limits(CLI::App* command, FileLimits& limits, const std::string& otherwise) {
  const std::string end = " that reading a file may use (default: " + otherwise + ")";
  add_amount(command, "--file-memory", limits.memory_mb, "megabytes", "megabytes" + end);
  add_amount(command, "--file-seconds", limits.seconds, "seconds", "seconds of processor time" + end);
}

void add_shared_cache(CLI::App* command) {
  command
      ->add_option_function<std::string>(
          "--shared-cache", [](const std::string& folder) { setenv("MARROW_SHARED_CACHE", folder.c_str(), 1); },
          "folder in which hosts share results (default: MARROW_SHARED_CACHE)")
      ->type_name("FOLDER");
}

void add_log_level(CLI::App* command, LogLevel& level) {
  const std::map<std::string, LogLevel> levels{
      {"debug", LogLevel::debug}, {"info", LogLevel::info}, {"warning", LogLevel::warning}, {"error", LogLevel::error}};
  CLI::Option* named =
      command
          ->add_option("--log-level", level,
                       "show messages of this level and above: debug, info, warning or error (default: info)")
          ->transform(CLI::CheckedTransformer(levels).description(""))
          ->type_name("LEVEL");
  command
      ->add_flag_callback(
          "-v,--verbose", [&level] { level = LogLevel::debug; }, "as --log-level debug")
      ->excludes(named);
}

void say_that_libraries_are_described(CLI::App* command) {
  command->footer(
      "A plugin library that marrow does not know yet is loaded once in a separate process, which describes it. Only "
      "folders that nobody else may write to are searched: see 'marrow doctor' and MARROW_PLUGIN_PATH.");
}

void print_beside(const std::string& head, const std::string& text, std::size_t indent) {
  std::fputs(wrapped_beside(head, text, indent, terminal_columns()).c_str(), stdout);
}

std::shared_ptr<CLI::FormatterBase> wrapped_help() { return std::make_shared<WrappedHelp>(); }

}  // namespace marrow::cli
