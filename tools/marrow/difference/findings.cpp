// SPDX-License-Identifier: Apache-2.0
#include "difference/findings.hpp"

#include <algorithm>

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

template <class T>
const T* named(const std::vector<T>& list, const std::string& name) {
  const auto found = std::find_if(list.begin(), list.end(), [&](const T& one) { return one.name == name; });
  return found == list.end() ? nullptr : &*found;
}

/// The files and nodes in which the values of a run can be found.
class Places {
 public:
  explicit Places(const RunRecord& run) : folder_(run.folder) {
    for (const RecordedResult& result : run.results)
      for (const RecordedItem& item : result.items) files_.emplace(item.key, std::pair(&result, item.place));
    for (const RecordedNode& node : run.nodes)
      for (const RecordedOutput& output : node.outputs)
        for (const RecordedItem& item : output.items) makers_.emplace(item.key, node.uses);
  }
  ValueOfRun of(const std::string& key) const {
    const auto file = files_.find(key);
    const auto maker = makers_.find(key);
    return {key, file == files_.end() ? fs::path() : file->second.first->file_of(folder_, file->second.second),
            maker == makers_.end() ? "" : maker->second};
  }

 private:
  fs::path folder_;
  std::map<std::string, std::pair<const RecordedResult*, std::string>>
      files_;  ///< by key: an output, and the place of the item in it
  std::map<std::string, std::string> makers_;
};

class Finder {
 public:
  Finder(const Findings& findings, KnownValues& values)
      : before_(findings.before), now_(findings.now), values_(values) {}

  /// Compares the items of an output. Items that are absent in both runs do not count.
  OutputDifference compare(const std::string& name, const std::vector<RecordedItem>& before,
                           const std::vector<RecordedItem>& now) {
    OutputDifference difference{name, {}, {}, 0};
    const auto find = [](const std::vector<RecordedItem>& items, const std::string& place) {
      const auto found =
          std::find_if(items.begin(), items.end(), [&](const RecordedItem& item) { return item.place == place; });
      return found == items.end() || found->is_absent() ? "" : found->key;
    };
    for (const RecordedItem& item : before)
      if (!item.is_absent()) add(item.place, item.key, find(now, item.place), difference);
    for (const RecordedItem& item : now)
      if (!item.is_absent() && find(before, item.place).empty()) add(item.place, "", item.key, difference);
    return difference;
  }

 private:
  void add(const std::string& place, const std::string& before, const std::string& now, OutputDifference& difference) {
    if (before == now) {
      ++difference.same;
      return;
    }
    ItemDifference item{place, before, now, {}};
    if (now.empty())
      item.amount.lines = {kIsNotThere};
    else if (before.empty())
      item.amount.lines = {kWasNotThere};
    else
      item.amount = values_.amount(before_.of(before), now_.of(now));
    difference.items.push_back(std::move(item));
  }

  Places before_, now_;
  KnownValues& values_;
};

/// Whether the text says why an output could not be written. If an output was not made, the nodes say why.
bool is_fault(const std::string& text) { return !text.empty() && !text.starts_with("not made"); }

/// The outputs of a root that differ.
std::vector<OutputDifference> outputs_of(const Root& root, Finder& finder) {
  std::vector<OutputDifference> differences;
  const auto before = root.before->data(), now = root.now->data();
  const bool only_ones = before.size() == 1 && now.size() == 1;  // another node may name its only output differently
  for (const RecordedOutput* output : now) {
    const auto old = std::find_if(before.begin(), before.end(),
                                  [&](const RecordedOutput* one) { return only_ones || one->name == output->name; });
    OutputDifference difference =
        finder.compare(output->name, old == before.end() ? std::vector<RecordedItem>() : (*old)->items, output->items);
    if (difference.is_none() && difference.same && old != before.end() && (*old)->key != output->key)
      difference.notes.push_back("the same items in another order");
    if (!difference.is_none()) differences.push_back(std::move(difference));
  }
  return differences;
}

json json_of(const Change& change) {
  json result = {{"what", change.what},
                 {"node", change.node},
                 {"before", change.before},
                 {"now", change.now},
                 {"text", change.text}};
  if (!change.name.empty()) result["name"] = change.name;
  return result;
}

json json_of(const std::vector<OutputDifference>& outputs) {
  json list = json::array();
  for (const OutputDifference& output : outputs) {
    json items = json::array();
    for (const ItemDifference& item : output.items)
      items.push_back({{"place", item.place},
                       {"before", item.key_before},
                       {"now", item.key_now},
                       {"amount", item.amount.facts},
                       {"text", item.amount.lines}});
    list.push_back({{"name", output.name},
                    {"identical", output.is_none()},
                    {"items", items},
                    {"notes", output.notes},
                    {"same_items", output.same}});
  }
  return list;
}

json json_of(const Root& root) {
  json why = json::array();
  for (const Change& change : root.why) why.push_back(json_of(change));
  const auto fate = [](const RecordedNode& node) { return json{{"status", node.status}, {"reason", node.reason}}; };
  return {{"node", root.now->id},
          {"uses", root.now->uses},
          {"why", why},
          {"before", fate(*root.before)},
          {"now", fate(*root.now)}};
}

}  // namespace

Findings::Findings(RunRecord before_run, RunRecord now_run)
    : before(std::move(before_run)), now(std::move(now_run)), difference(difference_of(before, now)) {}

bool Findings::identical() const {
  return damaged.empty() && difference.is_none() &&
         std::all_of(results.begin(), results.end(), [](const OutputDifference& output) { return output.is_none(); });
}

Findings find_differences(RunRecord before, RunRecord now, KnownValues& values) {
  Findings findings(std::move(before), std::move(now));
  Finder finder(findings, values);
  const std::vector<RecordedItem> none;
  if (!findings.difference.roots.empty()) findings.first = outputs_of(findings.difference.roots[0], finder);
  for (const RecordedResult& result : findings.before.results) {
    const RecordedResult* other = named(findings.now.results, result.name);
    findings.results.push_back(finder.compare(result.name, result.items, other ? other->items : none));
    if (!other || other->fault == result.fault) continue;
    if (is_fault(other->fault)) findings.results.back().notes.push_back(other->fault);
    if (is_fault(result.fault)) findings.results.back().notes.push_back("in the first run: " + result.fault);
  }
  for (const RecordedResult& result : findings.now.results)
    if (!named(findings.before.results, result.name))
      findings.results.push_back(finder.compare(result.name, none, result.items));
  findings.damaged = damaged_files(findings.before);
  if (findings.before.folder != findings.now.folder)
    for (std::string& file : damaged_files(findings.now)) findings.damaged.push_back(std::move(file));
  return findings;
}

json json_of(const Findings& findings) {
  const RunDifference& difference = findings.difference;
  json others = json::array(), roots = json::array(), rebuilt = json::array();
  for (const Change& change : difference.others) others.push_back(json_of(change));
  for (const Change& change : difference.rebuilt)
    rebuilt.push_back({{"file", change.name}, {"before", change.before}, {"now", change.now}});
  for (const Root& root : difference.roots) roots.push_back(json_of(root));
  json result = {{"before", findings.before.folder.string()},
                 {"now", findings.now.folder.string()},
                 {"identical", findings.identical()},
                 {"nodes",
                  {{"same", difference.same},
                   {"in_consequence", difference.in_consequence},
                   {"only_before", difference.only_before},
                   {"only_now", difference.only_now}}},
                 {"first", nullptr},
                 {"differ_by_themselves", roots},
                 {"other_changes", others},
                 {"rebuilt_plugins", rebuilt},
                 {"framework_rebuilt", findings.before.framework != findings.now.framework},
                 {"outputs", json_of(findings.results)},
                 {"damaged_files", findings.damaged}};
  if (!roots.empty()) {
    result["first"] = roots[0];
    result["first"]["outputs"] = json_of(findings.first);
    result["differ_by_themselves"].erase(0);
  }
  return result;
}

}  // namespace marrow::cli
