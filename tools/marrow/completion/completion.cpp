// SPDX-License-Identifier: Apache-2.0
// `marrow completion`, and `marrow complete`, which the scripts of the shells call.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "commands.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

/// A word that may be typed, and what it means in one line; may be empty.
struct Candidate {
  std::string word, help;
};

struct Wishes {
  std::vector<Candidate> candidates;
  bool files = false, folders = false;  ///< the shell knows these
};

/// A command line as far as it is typed.
struct Typed {
  std::string command;              ///< "run", or "cache gc"
  std::vector<std::string> given;   ///< what is given beside options, such as the pipeline's file
  std::string place;                ///< what is being typed: "--set" or the name of a positional
  std::string type;                 ///< the option's type in the help, such as FOLDER or TEXT:{a,b}
  std::string value;                ///< what is typed of it
  std::vector<std::string> before;  ///< values that the option has already
};

// Values of options and positionals. What a value is, its type in the help says; of a pipeline, the pipeline itself.

/// Collects words that begin with what is typed.
class Beginning {
 public:
  explicit Beginning(const std::string& typed) : typed_(typed) {}
  void add(const std::string& word, const std::string& help = "") {
    if (word.starts_with(typed_)) wishes_.candidates.push_back({word, help});
  }
  Wishes wishes() { return std::move(wishes_); }

 private:
  const std::string& typed_;
  Wishes wishes_;
};

/// The choices of a type such as TEXT:{slurm,local}.
std::vector<std::string> choices_of(const std::string& type) {
  const std::size_t begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

/// All nodes, or those of a kind.
void add_nodes(Beginning& beginning, const Catalogue& catalogue, const std::string& before = "",
               const std::string& kind = "") {
  for (const std::string& name : catalogue.node_names()) {
    const NodeInfo& node = *catalogue.find(name);
    if (kind.empty() || node.kind() == kind) beginning.add(before + name, node.summary);
  }
}

void add_kinds(Beginning& beginning, const Catalogue& catalogue, const std::string& after = "") {
  for (const std::string& name : catalogue.kind_names()) {
    const KindInfo* kind = catalogue.find_kind(name);
    beginning.add(name + after, kind ? kind->summary : "");
  }
}

Pipeline pipeline_at(const std::string& file, const Catalogue& catalogue) {
  Diagnostics diagnostics;
  return read_pipeline(file, {}, catalogue, diagnostics, false);
}

/// The node's name in a change: PART.NODE for the node PART/NODE.
std::string name_in_changes(const PipelineNode& node) {
  std::string name = node.id;
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

/// The pipeline's inputs, also those of files that it extends, as NAME=.
void add_inputs(Beginning& beginning, const std::string& file) {
  for (const PipelineInput& input : pipeline_at(file, Catalogue()).inputs)
    if (!input.is_data) beginning.add(input.name + "=", input.help);
}

/// What changes one node: its options, and what all nodes have.
void add_changes(Beginning& beginning, const PipelineNode& node) {
  const std::string before = name_in_changes(node) + ".";
  beginning.add(before + "uses=", "another node in its place");
  beginning.add(before + "may_fail=", "whether the run goes on without it");
  for (const OptionInfo& option : node.info.options) beginning.add(before + option.name + "=", option.help);
}

void add_values_of_change(Beginning& beginning, const PipelineNode& node, const std::string& name,
                          const Catalogue& catalogue) {
  const std::string before = name_in_changes(node) + "." + name + "=";
  if (name == "uses") add_nodes(beginning, catalogue, before, node.info.kind());
  std::vector<std::string> values;
  if (name == "may_fail") values = {"true", "false"};
  for (const OptionInfo& option : node.info.options) {
    if (option.name != name) continue;
    values = option.choices;
    if (option.type == OptionType::boolean) values = {"true", "false"};
  }
  for (const std::string& value : values) beginning.add(before + value);
}

/// node.option=value: one part after the other.
void add_overrides(Beginning& beginning, const std::string& typed, const std::string& file) {
  const Catalogue catalogue;
  const std::size_t equals = typed.find('=');
  for (const PipelineNode& node : pipeline_at(file, catalogue).nodes) {
    const std::string before = name_in_changes(node) + ".";
    if (!typed.starts_with(before))
      beginning.add(before, node.info.name);
    else if (!node.repetition && equals == std::string::npos)
      add_changes(beginning, node);
    else if (!node.repetition)
      add_values_of_change(beginning, node, typed.substr(before.size(), equals - before.size()), catalogue);
  }
}

/// What the pipeline says, if the value has to do with it.
void add_of_pipeline(Beginning& beginning, const Typed& typed) {
  const std::string file = typed.given.empty() ? "" : typed.given[0];
  if (typed.place == "inputs")
    add_inputs(beginning, file);
  else if (typed.place == "--set" && !file.empty())
    add_overrides(beginning, typed.value, file);
  else if (typed.place == "--only")
    for (const PipelineOutput& output : pipeline_at(file, Catalogue()).outputs) beginning.add(output.name);
}

/// The values that begin with what is typed. They need the known nodes, or the pipeline.
Wishes values_for(const Typed& typed) {
  Beginning beginning(typed.value);
  const auto is = [&](const char* type) { return typed.type == type; };
  const bool is_value_of_input = typed.place == "inputs" && typed.value.find('=') != std::string::npos;
  if (is_value_of_input || is("FILE") || is("PATH") || typed.place == "pipeline") return {{}, true, false};
  if (is("FOLDER")) return {{}, false, true};
  if (is("WHOLE NUMBER") || is("NUMBER")) return {};
  for (const std::string& choice : choices_of(typed.type)) beginning.add(choice);
  if (is("LEVEL"))
    for (const char* level : {"debug", "info", "warning", "error"}) beginning.add(level);
  if (is("NODE")) add_nodes(beginning, Catalogue());
  if (is("KIND")) add_kinds(beginning, Catalogue());
  if (typed.command == "new node" && typed.place == "name") add_kinds(beginning, Catalogue(), ".");
  try {
    if (is("FILE NODE") && typed.before.empty()) return {{}, true, false};
    if (is("FILE NODE"))
      for (const PipelineNode& node : pipeline_at(typed.before[0], Catalogue()).nodes)
        beginning.add(node.id, node.info.name);
    add_of_pipeline(beginning, typed);
  } catch (const std::exception&) {  // there is no such pipeline, so nothing is known of it
  }
  return beginning.wishes();
}

/// Walks through the words that are complete.
class Reader {
 public:
  explicit Reader(const CLI::App& app) : at_(&app) {}

  void take(const std::string& word) {
    if (wanted_ > 0)
      take_value(word);
    else if (word == "--")
      only_positionals_ = true;
    else if (!only_positionals_ && word.size() > 1 && word[0] == '-')
      take_option(word);
    else
      take_bare(word);
  }

  Wishes wishes(const std::string& word) const {
    if (wanted_ > 0) return of_option(*option_, word, values_, "");
    const std::size_t equals = word.find('=');
    if (!only_positionals_ && word.starts_with("--") && equals != std::string::npos) {
      const CLI::Option* option = at_->get_option_no_throw(word.substr(0, equals));
      return option ? of_option(*option, word.substr(equals + 1), {}, word.substr(0, equals + 1)) : Wishes();
    }
    if (!only_positionals_ && word.starts_with('-')) return options(word);
    if (!commands().empty()) return named_commands(word);
    const CLI::Option* positional = next_positional();
    if (positional != nullptr) return of_option(*positional, word, {}, "");
    if (at_->get_prefix_command()) return {{}, true, false};
    return word.empty() ? options(word) : Wishes();
  }

 private:
  std::vector<const CLI::App*> commands() const {
    return at_->get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); });
  }

  void take_value(const std::string& word) {
    --wanted_;
    values_.push_back(word);
  }

  void take_option(const std::string& word) {
    option_ = at_->get_option_no_throw(word);
    wanted_ = option_ ? std::max(0, option_->get_items_expected_min()) : 0;
    values_.clear();
  }

  void take_bare(const std::string& word) {
    for (const CLI::App* one : at_->get_subcommands(nullptr))
      if (one->get_name() == word) {
        at_ = one;
        command_ += (command_.empty() ? "" : " ") + word;
        return;
      }
    given_.push_back(word);
  }

  /// The last one, if it takes any number of words, stands for all further ones.
  const CLI::Option* next_positional() const {
    std::size_t left = given_.size();
    for (const CLI::Option* option : at_->get_options([](const CLI::Option* one) { return one->get_positional(); }))
      if (left == 0 || option->get_items_expected_max() > 1)
        return option;
      else
        --left;
    return nullptr;
  }

  Wishes of_option(const CLI::Option& option, const std::string& value, std::vector<std::string> before,
                   const std::string& start) const {
    const std::string place = option.get_positional() ? option.get_name(true, false) : "--" + option.get_lnames()[0];
    Wishes wishes = values_for({command_, given_, place, option.get_type_name(), value, std::move(before)});
    for (Candidate& one : wishes.candidates) one.word = start + one.word;
    return wishes;
  }

  Wishes options(const std::string& begin) const {
    Wishes wishes;
    for (const CLI::Option* option : at_->get_options([](const CLI::Option* one) { return one->nonpositional(); }))
      for (const std::string& name : option->get_lnames())
        if (("--" + name).starts_with(begin)) wishes.candidates.push_back({"--" + name, option->get_description()});
    return wishes;
  }

  Wishes named_commands(const std::string& begin) const {
    Wishes wishes;
    for (const CLI::App* one : commands())
      if (one->get_name().starts_with(begin)) wishes.candidates.push_back({one->get_name(), one->get_description()});
    return wishes;
  }

  const CLI::App* at_;
  const CLI::Option* option_ = nullptr;  ///< it still takes `wanted_` words
  int wanted_ = 0;
  std::vector<std::string> values_;  ///< that it took already
  bool only_positionals_ = false;
  std::string command_;
  std::vector<std::string> given_;
};

/// `words` are those after the program's name; the last one is being typed and may be empty.
Wishes wishes_for(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) return {};
  Reader reader(app);
  for (std::size_t i = 0; i + 1 < words.size(); ++i) reader.take(words[i]);
  return reader.wishes(words.back());
}

// The scripts hand the words over in lines. `marrow complete` answers with a line for each word, with a tab before what
// it means, and with :files or :folders where the shell is to name them.

constexpr const char* kBash = R"script(# Completion of marrow for bash, by: marrow completion bash
_marrow() {
  local line=$COMP_LINE words=() word help current prefix= i
  # bash splits words at = and :, so what follows without a blank is put together again.
  for ((i = 0; i <= COMP_CWORD; i++)); do
    word=${COMP_WORDS[i]}
    if [[ $i -gt 0 && -n $word && $line == "$word"* ]]; then
      words[${#words[@]}-1]+=$word
    else
      words+=("$word")
    fi
    line=${line#*"$word"}
  done
  current=${words[${#words[@]}-1]}
  # Then only what follows the last = is replaced.
  [[ $COMP_WORDBREAKS == *=* && $current == *=* ]] && prefix=${current%=*}=
  COMPREPLY=()
  while IFS=$'\t' read -r word help; do
    case $word in
      :files) compopt -o filenames; mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -f -- "${current##*=}") ;;
      :folders) compopt -o filenames; mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -d -- "${current##*=}") ;;
      *) COMPREPLY+=("${word#"$prefix"}") ;;
    esac
    [[ $word == *[=.] ]] && compopt -o nospace
  done < <(printf '%s\n' "${words[@]:1}" | "${words[0]/#\~/$HOME}" complete 2>/dev/null)
}
complete -F _marrow marrow
)script";

constexpr const char* kFish = R"script(# Completion of marrow for fish, by: marrow completion fish
function __marrow_complete
    set -l words (commandline -opc)
    set -l current (commandline -ct)
    set -l answer (string join \n -- $words[2..-1] "$current" | $words[1] complete 2>/dev/null)
    set -l prefix ""
    string match -q '*=*' -- $current; and set prefix (string replace -r '[^=]*$' '' -- $current)
    for line in $answer
        switch $line
            case :files
                set -l files (__fish_complete_path (string replace -r '^.*=' '' -- $current))
                test -n "$files"; and printf '%s\n' $prefix$files
            case :folders
                set -l folders (__fish_complete_directories (string replace -r '^.*=' '' -- $current))
                test -n "$folders"; and printf '%s\n' $prefix$folders
            case '*'
                echo $line
        end
    end
end
complete -c marrow -f -a '(__marrow_complete)'
)script";

constexpr const char* kZsh = R"script(#compdef marrow
# Completion of marrow for zsh, by: marrow completion zsh
_marrow() {
  local line word
  local -a whole begun told_whole told_begun
  while IFS= read -r line; do
    word=${line%%$'\t'*}
    line=${line/$'\t'/  -- }
    case $word in
      :files) compset -P '*='; _files ;;
      :folders) compset -P '*='; _files -/ ;;
      *[=.]) begun+=($word); told_begun+=($line) ;;
      *) whole+=($word); told_whole+=($line) ;;
    esac
  done < <(print -rl -- "${(@)words[2,CURRENT-1]}" "$PREFIX" | ${~words[1]} complete 2>/dev/null)
  (( $#whole )) && compadd -l -d told_whole -a whole
  (( $#begun )) && compadd -S '' -l -d told_begun -a begun
}
if [[ $funcstack[1] == _marrow ]]; then
  _marrow "$@"
else
  compdef _marrow marrow
fi
)script";

const std::map<std::string, const char*>& scripts() {
  static const std::map<std::string, const char*> all{{"bash", kBash}, {"fish", kFish}, {"zsh", kZsh}};
  return all;
}

/// The shells that have a script: bash, fish, zsh.
std::vector<std::string> shells() {
  std::vector<std::string> names;
  for (const auto& [name, script] : scripts()) names.push_back(name);
  return names;
}

/// The script by which the shell completes marrow's words. It asks `marrow complete`.
std::string completion_script(const std::string& shell) { return scripts().at(shell); }

void complete(const CLI::App& app) {
  std::vector<std::string> words;
  for (std::string word; std::getline(std::cin, word);) words.push_back(word);
  const Wishes wishes = wishes_for(app, words);
  for (const Candidate& one : wishes.candidates)
    std::printf("%s%s%s\n", printable(one.word).c_str(), one.help.empty() ? "" : "\t", printable(one.help).c_str());
  if (wishes.files) std::printf(":files\n");
  if (wishes.folders) std::printf(":folders\n");
}

}  // namespace

void add_completion(CLI::App& app, int&) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("completion", "print the script by which a shell completes marrow's words");
  command->add_option("shell", *shell, "bash, fish or zsh")->required()->check(CLI::IsMember(shells()));
  command->footer(
      "For this shell: source <(marrow completion bash), or marrow completion fish | source. For all: save it as "
      "~/.local/share/bash-completion/completions/marrow, as ~/.config/fish/completions/marrow.fish, or as _marrow in "
      "a "
      "folder of zsh's fpath. The Debian package has done that.");
  command->callback([shell] { std::fputs(completion_script(*shell).c_str(), stdout); });
  CLI::App* asked = app.add_subcommand("complete", "say what the last line of the standard input may become");
  asked->group("");
  asked->callback([&app] { complete(app); });
}

}  // namespace marrow::cli
