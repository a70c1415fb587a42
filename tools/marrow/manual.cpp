// SPDX-License-Identifier: Apache-2.0
// `marrow manual`: a manual page for each command, made from what its help says. It is called when marrow is built.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <filesystem>

#include "commands.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

/// A text as troff shows it. Its lines are joined, and none of it is taken for a request.
std::string plain(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else if (c == '\n')
      result += ' ';
    else if ((c == '.' || c == '\'') && result.empty())
      result += std::string("\\&") + c;
    else
      result += c;
  }
  return result;
}

std::string bold(const std::string& text) { return "\\fB" + plain(text) + "\\fR"; }

std::string capitals(std::string text) {
  for (char& c : text) c = char(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

bool is_shown(const CLI::App& command) { return !command.get_group().empty(); }

std::vector<const CLI::App*> shown_commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* one) { return is_shown(*one); });
}

/// "marrow cache gc"
std::string whole_name(const CLI::App& app) {
  return app.get_parent() ? whole_name(*app.get_parent()) + " " + app.get_name() : "marrow";
}

std::string page_of(const CLI::App& app) {
  std::string name = whole_name(app);
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

/// The names of an option, or of what is given without one, and what follows them.
std::string heading_of(const CLI::Option& option) {
  std::string names;
  if (option.get_positional())
    names = bold(option.get_name(true, false));
  else
    for (const auto& [dashes, all] : {std::pair("-", option.get_snames()), std::pair("--", option.get_lnames())})
      for (const std::string& name : all) names += (names.empty() ? "" : ", ") + bold(dashes + name);
  if (option.get_items_expected_max() > 0 && !option.get_positional()) names += " " + plain(option.get_type_name());
  return names;
}

std::string section_of(const std::string& title, const std::vector<const CLI::Option*>& options) {
  if (options.empty()) return "";
  std::string text = ".SH " + title + "\n";
  for (const CLI::Option* option : options) {
    text += ".TP\n" + heading_of(*option) + "\n" + plain(option->get_description());
    if (!option->get_default_str().empty()) text += " (default: " + plain(option->get_default_str()) + ")";
    text += "\n";
  }
  return text;
}

std::string synopsis_of(const CLI::App& app, const std::vector<const CLI::Option*>& positionals, bool has_options) {
  std::string text = ".SH SYNOPSIS\n" + bold(whole_name(app));
  if (has_options) text += " [options]";
  if (!shown_commands(app).empty()) text += " command ...";
  for (const CLI::Option* option : positionals) {
    const std::string name = "\\fI" + plain(option->get_name(true, false)) + "\\fR";
    const std::string more = option->get_items_expected_max() > 1 ? "..." : "";
    text += option->get_required() ? " " + name + more : " [" + name + more + "]";
  }
  return text + "\n";
}

constexpr const char* kOfTheProgram = R"(.SH EXIT STATUS
.TP
0
success; of \fBdiff\fR and \fBrerun\fR: the results are the same
.TP
1
a node or a library failed; of \fBdiff\fR and \fBrerun\fR: the results differ
.TP
2
a fault in what was asked for, or in a file; nothing was run
.TP
3
from \fBrun\fR: nothing failed, but a verdict says that a pose is wrong
.TP
130
stopped by Ctrl\-C
.SH ENVIRONMENT
.TP
\fBMARROW_PLUGIN_PATH\fR
folders with plugins, separated by colons, which are searched before marrow's own
.TP
\fBMARROW_CACHE\fR
folder of the store of results
.TP
\fBMARROW_CACHE_GB\fR
its size, in gigabytes, above which the least recently used results are removed
.TP
\fBMARROW_SHARED_CACHE\fR
folder in which hosts share results
.TP
\fBMARROW_PYTHON\fR
the interpreter of nodes in Python
)";

std::string manual_page(const CLI::App& app) {
  const auto positionals = app.get_options([](const CLI::Option* one) { return one->get_positional(); });
  const auto options = app.get_options([](const CLI::Option* one) { return one->nonpositional(); });
  std::string text = ".TH " + capitals(page_of(app)) + " 1 \"\" \"" + version_text() + "\" \"marrow\"\n";
  text += ".nh\n.ad l\n.SH NAME\n" + plain(page_of(app)) + " \\- " + plain(app.get_description()) + "\n";
  text += synopsis_of(app, positionals, !options.empty());
  if (!app.get_footer().empty()) text += ".SH DESCRIPTION\n" + plain(app.get_footer()) + "\n";
  const std::vector<const CLI::App*> commands = shown_commands(app);
  if (!commands.empty()) text += ".SH COMMANDS\n";
  for (const CLI::App* one : commands)
    text += ".TP\n" + bold(page_of(*one)) + "(1)\n" + plain(one->get_description()) + "\n";
  text += section_of("ARGUMENTS", positionals) + section_of("OPTIONS", options);
  if (!app.get_parent()) return text + kOfTheProgram;
  return text + ".SH SEE ALSO\n" + bold(page_of(*app.get_parent())) + "(1)\n";
}

/// A command that hands its words to another program has its page from there.
void write_pages(const CLI::App& app, const fs::path& folder) {
  for (const CLI::App* one : shown_commands(app)) {
    if (one->get_prefix_command()) continue;
    write_text_file(folder / (page_of(*one) + ".1"), manual_page(*one));
    write_pages(*one, folder);
  }
}

}  // namespace

void add_manual(CLI::App& app, int&) {
  const auto folder = std::make_shared<fs::path>();
  CLI::App* command = app.add_subcommand("manual", "write the manual pages of all commands");
  command->group("");
  command->add_option("-o,--out", *folder, "where to put them")->required()->type_name("FOLDER");
  command->callback([folder, &app] {
    fs::create_directories(*folder);
    write_pages(app, *folder);
    if (shown_commands(app).size() > 1) write_text_file(*folder / "marrow.1", manual_page(app));
  });
}

}  // namespace marrow::cli
