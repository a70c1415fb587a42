// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/replay.hpp"

#include <cctype>
#include <cstdlib>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow {

void CallKeys::note(const std::string& within, const std::string& node, const std::string& item, const Digest& key) {
  const std::scoped_lock lock(mutex_);
  keys_.insert_or_assign({within, node, item}, key);
}

KeysOfCalls CallKeys::all() const {
  const std::scoped_lock lock(mutex_);
  return keys_;
}

std::optional<Digest> Replay::kept_key(const std::string& run_within, const std::string& id,
                                       const std::string& place) const {
  auto found = kept.find({run_within, id, place});
  if (const std::size_t slash = run_within.rfind('/'); found == kept.end() && slash != run_within.npos)
    found = kept.find({run_within.substr(0, slash), id, place});
  return found == kept.end() ? std::nullopt : std::optional(found->second);
}

bool Replay::leads_into(const std::string& path) const {
  return path.empty() || within == path || within.starts_with(path + "/");
}

bool keep_only_replayed(Pipeline& pipeline, const RunSettings& settings) {
  const Replay& replay = *settings.replay;
  if (!replay.leads_into(settings.within)) return false;
  const std::string& around = settings.within;
  const bool is_here = replay.within == around;
  const auto is_it = [&](const PipelineNode& node) {
    if (is_here) return node.id == replay.node;
    return node.repetition && replay.leads_into((around.empty() ? "" : around + "/") + node.id);
  };
  const auto found = std::find_if(pipeline.nodes.begin(), pipeline.nodes.end(), is_it);
  if (found == pipeline.nodes.end())
    throw Error(pipeline.file.string() + " has no node " + in_quotes(is_here ? replay.node : replay.within));
  pipeline.outputs.clear();
  for (std::size_t i = 0; i < found->info.outputs.size(); ++i) {
    const std::string& name = found->info.outputs[i].name;
    pipeline.outputs.push_back(
        {name, {found->id + "." + name, found->place, int(found - pipeline.nodes.begin()), int(i), {}}});
  }
  return true;
}

namespace {

/// Whether a path goes on with this character.
bool continues_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '-'; }

/// The text with $env:HOME in place of the user's home folder. In an option of a pipeline both mean the same.
std::string without_home(std::string text) {
  const char* variable = std::getenv("HOME");
  std::string home = variable ? variable : "";
  while (home.ends_with('/')) home.pop_back();
  if (!home.starts_with('/')) return text;
  const std::string name = "$env:HOME";
  for (std::size_t at = 0; (at = text.find(home, at)) != std::string::npos;) {
    const std::size_t end = at + home.size();
    const bool begins = at == 0 || !(continues_name(text[at - 1]) || text[at - 1] == '/');
    const bool is_home = begins && (end == text.size() || !continues_name(text[end]));
    if (is_home) text.replace(at, home.size(), name);
    at += is_home ? name.size() : home.size();
  }
  return text;
}

}  // namespace

std::string RunRecipe::text() const {
  std::string options = formatted("--seed {}", seed);
  if (file_limits.memory_mb > 0) options += " --file-memory " + exact_number(file_limits.memory_mb);
  if (file_limits.seconds > 0) options += " --file-seconds " + exact_number(file_limits.seconds);
  return "# The recipe of a run with marrow " + printable(version) +
         ".\n# As a file, it runs again by: marrow run FILE " + options + "\n" + without_home(pipeline);
}

RunRecipe recipe_of_run(const Pipeline& pipeline, const RunSettings& settings) {
  return {MARROW_VERSION, settings.seed, settings.file_limits, resolved_yaml(pipeline)};
}

}  // namespace marrow
