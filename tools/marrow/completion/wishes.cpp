// SPDX-License-Identifier: Apache-2.0
#include "wishes.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace marrow::cli {
namespace {

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

}  // namespace

Wishes wishes_for(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) return {};
  Reader reader(app);
  for (std::size_t i = 0; i + 1 < words.size(); ++i) reader.take(words[i]);
  return reader.wishes(words.back());
}

}  // namespace marrow::cli
