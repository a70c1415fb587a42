// SPDX-License-Identifier: Apache-2.0
#include "columns.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <sstream>

namespace marrow::cli {
namespace {

constexpr std::size_t kLeastRoom = 24;   // a narrower column is hard to read
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

std::size_t terminal_columns() {
  winsize size{};
  return isatty(STDOUT_FILENO) && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

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

void print_beside(const std::string& head, const std::string& text, std::size_t indent) {
  std::fputs(wrapped_beside(head, text, indent, terminal_columns()).c_str(), stdout);
}

std::shared_ptr<CLI::FormatterBase> wrapped_help() { return std::make_shared<WrappedHelp>(); }

}  // namespace marrow::cli
