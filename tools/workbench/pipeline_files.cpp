// SPDX-License-Identifier: Apache-2.0
#include "workbench/pipeline_files.hpp"

#include "marrow/base/error.hpp"
#include "marrow/base/hash.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "workbench/server.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostSteps = 200;

std::string digest_of(const std::string& text) { return hash_of_bytes(text.data(), text.size()).hex(); }

}  // namespace

void PipelineFiles::add(History& history, Step step) {
  history.steps.resize(history.steps.empty() ? 0 : history.at + 1);
  history.steps.push_back(std::move(step));
  if (history.steps.size() > kMostSteps) history.steps.erase(history.steps.begin());
  history.at = history.steps.size() - 1;
}

PipelineFiles::History& PipelineFiles::find(const std::string& file) {
  std::string text = read_text_file(folder_.inside(file), kMostSourceBytes);
  History& history = histories_[file];
  if (history.steps.empty())
    add(history, {"the file as it was found", std::move(text)});
  else if (history.steps[history.at].text != text)
    add(history, {"a change by another program", std::move(text)});
  return history;
}

PipelineFiles::History& PipelineFiles::find(const std::string& file, const std::string& revision) {
  History& history = find(file);
  if (digest_of(history.steps[history.at].text) != revision)
    throw Conflict(printable(file) + " was changed elsewhere; the page now shows what is newest");
  return history;
}

json PipelineFiles::shown(const std::string& file, const History& history) const {
  const std::string& text = history.steps[history.at].text;
  const bool can_redo = history.at + 1 < history.steps.size();
  return {{"file", file},
          {"text", text},
          {"revision", digest_of(text)},
          {"undo", history.at > 0 ? json(history.steps[history.at].what) : json()},
          {"redo", can_redo ? json(history.steps[history.at + 1].what) : json()}};
}

json PipelineFiles::open(const std::string& file) {
  const std::lock_guard lock(mutex_);
  return shown(file, find(file));
}

std::string PipelineFiles::revision(const std::string& file) const {
  return digest_of(read_text_file(folder_.inside(file), kMostSourceBytes));
}

json PipelineFiles::change(const std::string& file, const std::string& revision, const std::string& what,
                           const std::function<std::string(const std::string&)>& changed) {
  const std::lock_guard lock(mutex_);
  History& history = find(file, revision);
  std::string text = changed(history.steps[history.at].text);
  if (text != history.steps[history.at].text) {
    write_text_file(folder_.inside(file), text);
    add(history, {what, std::move(text)});
  }
  return shown(file, history);
}

json PipelineFiles::step(const std::string& file, const std::string& revision, int by) {
  const std::lock_guard lock(mutex_);
  History& history = find(file, revision);
  const std::size_t to = history.at + std::size_t(by);
  if (to < history.steps.size()) {  // a number below zero wraps around, and is too large
    write_text_file(folder_.inside(file), history.steps[to].text);
    history.at = to;
  }
  return shown(file, history);
}

}  // namespace marrow::workbench
