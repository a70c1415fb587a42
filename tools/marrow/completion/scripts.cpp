// SPDX-License-Identifier: Apache-2.0
// The scripts hand the words over in lines. `marrow complete` answers with a line for each word, with a tab before what
// it means, and with :files or :folders where the shell is to name them.
#include "scripts.hpp"

#include <map>

namespace marrow::cli {
namespace {

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

}  // namespace

std::vector<std::string> shells() {
  std::vector<std::string> names;
  for (const auto& [name, script] : scripts()) names.push_back(name);
  return names;
}

std::string completion_script(const std::string& shell) { return scripts().at(shell); }

}  // namespace marrow::cli
