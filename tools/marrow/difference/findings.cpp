// SPDX-License-Identifier: Apache-2.0
#include "difference/difference.hpp"

#include <algorithm>
#include <cstdio>
#include <set>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

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

std::string listed(const std::vector<std::string>& names) { return printable(joined(names, ", ")); }

void print_fate(const char* which, const RecordedNode& node) {
  if (node.went_well())
    std::printf("  %s it was done\n", which);
  else
    std::printf("  %s it %s%s%s\n", which,
                node.has_failed() ? node.status.c_str() : ("is '" + node.status + "'").c_str(),
                node.reason.empty() ? "" : ": ", printable_lines(node.reason).c_str());
}

void print_amount(const std::string& label, std::size_t width, const std::vector<std::string>& lines) {
  if (lines.size() == 1) {
    std::printf("  %-*s  %s\n", int(width), printable(label).c_str(), printable_lines(lines[0]).c_str());
    return;
  }
  std::printf("  %s\n", printable(label).c_str());
  for (const std::string& line : lines) std::printf("      %s\n", printable(line).c_str());
}

std::string label_of(const OutputDifference& output, const ItemDifference& item) {
  return printable(item.place.empty() ? output.name : output.name + " " + item.place);
}

/// The status of a node, if it is another one than in the other run. Otherwise "differ".
std::string fate_of(const Findings& findings, const std::string& id) {
  const RecordedNode &before = *findings.before.find(id), &now = *findings.now.find(id);
  if (!now.went_well() && now.status != before.status) return now.status;
  if (now.went_well() && !before.went_well()) return before.status + " in the first run";
  return "differ";
}

void print_consequences(const Findings& findings) {
  std::vector<std::pair<std::string, std::vector<std::string>>> groups{{"differ", {}}};
  for (const std::string& id : findings.difference.in_consequence) {
    const std::string fate = fate_of(findings, id);
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& one) { return one.first == fate; });
    if (group == groups.end())
      groups.push_back({fate, {id}});
    else
      group->second.push_back(id);
  }
  for (const auto& [fate, names] : groups)
    if (!names.empty()) std::printf("In consequence %s: %s\n", fate.c_str(), listed(names).c_str());
}

/// Whether all items of an output are missing in one of the runs. The nodes of that run say why.
bool is_only_missing(const OutputDifference& output, const char* text) {
  return !output.same && !output.items.empty() &&
         std::all_of(output.items.begin(), output.items.end(),
                     [&](const ItemDifference& item) { return item.amount.lines == std::vector<std::string>{text}; });
}

/// For a failed node: leaves out the outputs that one run does not have at all.
std::vector<OutputDifference> partly_there(std::vector<OutputDifference> outputs) {
  std::erase_if(outputs, [](const OutputDifference& output) {
    return is_only_missing(output, kIsNotThere) || is_only_missing(output, kWasNotThere);
  });
  return outputs;
}

/// Values that were shown already are only named.
void print_outputs(const std::vector<OutputDifference>& outputs, std::set<std::pair<std::string, std::string>>& shown) {
  std::size_t width = 0;
  for (const OutputDifference& output : outputs)
    for (const ItemDifference& item : output.items) width = std::max(width, label_of(output, item).size());
  for (const OutputDifference& output : outputs) {
    for (const std::string& note : output.notes) print_amount(output.name, width, {note});
    for (const ItemDifference& item : output.items) {
      const bool is_new = item.amount.lines.empty() || item.key_before.empty() || item.key_now.empty() ||
                          shown.insert({item.key_before, item.key_now}).second;
      print_amount(label_of(output, item), width, is_new ? item.amount.lines : std::vector<std::string>{"as above"});
    }
  }
}

void print_roots(const Findings& findings, std::set<std::pair<std::string, std::string>>& shown) {
  bool is_first = true;
  for (const Root& root : findings.difference.roots) {
    std::printf(is_first ? "First difference: node '%s' (%s)\n" : "Node '%s' (%s) differs by itself, too\n",
                printable(root.now->id).c_str(), printable(root.now->uses).c_str());
    if (!root.before->went_well() || !root.now->went_well()) {
      print_fate("in the first run", *root.before);
      print_fate("in the second run", *root.now);
    }
    for (const Change& change : root.why) std::printf("  why: %s\n", printable_lines(change.text).c_str());
    if (is_first)
      print_outputs(root.before->went_well() && root.now->went_well() ? findings.first : partly_there(findings.first),
                    shown);
    is_first = false;
  }
}

/// The nodes that ran in one of the runs only. The other pipeline may have them too, without an output that needs them.
void print_only(const std::vector<std::string>& names, const char* which, const RunRecord& other,
                const char* other_one) {
  std::vector<std::string> missing, not_needed;
  for (const std::string& name : names) (other.not_needed.contains(name) ? not_needed : missing).push_back(name);
  if (!missing.empty()) std::printf("Only in the %s run: %s\n", which, listed(missing).c_str());
  if (!not_needed.empty()) std::printf("Not needed in the %s run: %s\n", other_one, listed(not_needed).c_str());
}

void print_other_changes(const Findings& findings) {
  const RunDifference& difference = findings.difference;
  print_only(difference.only_before, "first", findings.now, "second");
  print_only(difference.only_now, "second", findings.before, "first");
  for (const Change& change : difference.others) {
    const RecordedNode* node = findings.now.find(change.node);
    const bool differs = contains(difference.in_consequence, change.node);
    std::printf("Also changed: %s%s%s\n", node ? printable("node '" + change.node + "': ").c_str() : "",
                printable_lines(change.text).c_str(),
                node && node->makes_data() && !differs ? " (with the same result)" : "");
  }
  if (difference.rebuilt.empty()) return;
  const bool is_all = findings.before.framework != findings.now.framework;
  std::vector<std::string> texts;
  for (const Change& change : difference.rebuilt) texts.push_back(is_all ? change.name : change.text);
  std::printf("Of another build: %s%s\n", is_all ? "marrow's own library, and with it the build ids of " : "",
              listed(texts).c_str());
}

void print_differing_results(const Findings& findings, std::set<std::pair<std::string, std::string>>& shown) {
  std::vector<OutputDifference> differing;
  std::vector<std::string> same, neither, only_before, only_now;
  for (const OutputDifference& output : findings.results)
    if (output.is_none())
      (output.same ? same : neither).push_back(output.name);
    else if (is_only_missing(output, kIsNotThere))
      only_before.push_back(output.name);
    else if (is_only_missing(output, kWasNotThere))
      only_now.push_back(output.name);
    else
      differing.push_back(output);
  std::printf("\n");
  if (!differing.empty()) std::printf("Outputs that differ\n");
  print_outputs(differing, shown);
  if (!only_before.empty()) std::printf("Outputs that only the first run has: %s\n", listed(only_before).c_str());
  if (!only_now.empty()) std::printf("Outputs that only the second run has: %s\n", listed(only_now).c_str());
  if (!neither.empty()) std::printf("Outputs that neither run has: %s\n", listed(neither).c_str());
  if (!same.empty()) std::printf("Outputs that are the same: %s\n", listed(same).c_str());
}

bool has_unknown_amount(const std::vector<OutputDifference>& outputs) {
  for (const OutputDifference& output : outputs)
    for (const ItemDifference& item : output.items)
      if (item.amount.facts.value("source", "") == "none") return true;
  return false;
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

// Prints the differences between two runs for people.

void print(const Findings& findings) {
  const RunDifference& difference = findings.difference;
  const std::string nodes = counted(difference.same, "node");
  std::printf("first run (was): %s\nsecond run (is): %s\n\n", printable(findings.before.folder.string()).c_str(),
              printable(findings.now.folder.string()).c_str());
  if (findings.identical()) {
    std::printf("identical: %s came out the same\n", difference.same == 1 ? "the only node" : ("all " + nodes).c_str());
    for (const RecordedNode& node : findings.now.nodes)
      if (!node.went_well() && node.status != "skipped")
        std::printf("node '%s' %s in both: %s\n", printable(node.id).c_str(), node.status.c_str(),
                    printable_lines(node.reason).c_str());
    print_other_changes(findings);
    return;
  }
  for (const std::string& file : findings.damaged) std::printf("%s\n", printable(file).c_str());
  if (!findings.damaged.empty()) std::printf("Everything else compares what the runs computed, not these files\n\n");
  std::set<std::pair<std::string, std::string>> shown;
  if (difference.roots.empty()) std::printf("What took part in both runs came out the same: %s\n", nodes.c_str());
  print_roots(findings, shown);
  print_consequences(findings);
  if (!difference.roots.empty()) std::printf("The same in both runs: %s\n", nodes.c_str());
  print_other_changes(findings);
  print_differing_results(findings, shown);
  if (has_unknown_amount(findings.first) || has_unknown_amount(findings.results))
    std::printf(
        "\nWhat the store no longer has is made again by running a folder's pipeline.yaml with its seed, as  marrow "
        "run %s --seed %llu\n",
        printable((findings.before.folder / "pipeline.yaml").string()).c_str(),
        static_cast<unsigned long long>(findings.before.seed));
}

}  // namespace marrow::cli
