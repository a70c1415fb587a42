// SPDX-License-Identifier: Apache-2.0
// `marrow completion`, and `marrow complete`, which the scripts of the shells call.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>

#include "commands.hpp"
#include "marrow/base/printable.hpp"
#include "scripts.hpp"
#include "wishes.hpp"

namespace marrow::cli {
namespace {

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
