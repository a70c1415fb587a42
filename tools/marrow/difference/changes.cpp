// SPDX-License-Identifier: Apache-2.0
#include "difference/difference.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/run/keys.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

/// A number in the shortest form with the same value: resolved pipelines hold numbers with 17 digits.
std::string shortened(const std::string& text) {
  if (text.starts_with("[") && text.ends_with("]")) {
    std::string result;
    for (std::size_t begin = 1; begin < text.size();) {
      const std::size_t end = std::min(text.find(", ", begin), text.size() - 1);
      result += (begin > 1 ? ", " : "") + shortened(text.substr(begin, end - begin));
      begin = end + (end == text.size() - 1 ? 1 : 2);
    }
    return "[" + result + "]";
  }
  const std::optional<double> value = parsed_number(text);
  return value ? shortest_number(*value) : text;
}

std::string is_was(const std::string& what, const std::string* before, const std::string* now) {
  if (!now) return what + " is not there, was " + *before;
  return what + " is " + *now + (before ? ", was " + *before : ", was not there");
}

/// " (mine.yaml:4, was femur.yaml:17)" if the file that says it is another one, or now the command line.
std::string other_place(const std::string& before, const std::string& now) {
  const auto file_of = [](const std::string& place) {
    return place.starts_with("--set ") ? std::string("--set") : place.substr(0, place.rfind(':'));
  };
  if (file_of(before) == file_of(now)) return "";
  const auto shown = [](const std::string& place) { return place.empty() ? std::string("the default") : place; };
  return " (" + shown(now) + ", was " + shown(before) + ")";
}

template <class Map>
std::set<std::string> names_in(const Map& a, const Map& b) {
  std::set<std::string> names;
  for (const auto& [name, value] : a) names.insert(name);
  for (const auto& [name, value] : b) names.insert(name);
  return names;
}

template <class Map>
const typename Map::mapped_type* find_in(const Map& map, const std::string& name) {
  const auto found = map.find(name);
  return found == map.end() ? nullptr : &found->second;
}

std::string file_or_folder(const std::string& path) {
  std::error_code error;
  return (fs::is_directory(path, error) ? "the folder " : fs::exists(path, error) ? "the file " : "") + path;
}

/// What an option of paths named: its text, a path or "[path, path]", and the digest of all names and contents.
struct NamedContent {
  std::string text, digest;
};

std::vector<std::string> paths_in(const std::string& text) {
  if (!text.starts_with("[") || !text.ends_with("]")) return {text};
  std::vector<std::string> paths;
  for (std::size_t begin = 1, end = 0; begin < text.size(); begin = end + 2) {
    end = std::min(text.find(", ", begin), text.size() - 1);
    if (end > begin) paths.push_back(text.substr(begin, end - begin));
  }
  return paths;
}

/// The contents of the files that an option named, without their names. Nothing if they have changed since the run.
std::optional<std::multiset<std::string>> contents_of(const NamedContent& named) {
  std::multiset<std::string> contents;
  Hasher hasher;  // as contents_of_options() makes the digest
  try {
    for (const std::string& path : paths_in(named.text)) {
      const PathContent content = content_of(path);
      hasher.add(content.digest);
      for (const auto& [file, digest] : content.files) contents.insert(digest.hex());
    }
  } catch (const Error&) {  // it can no longer be read
    return std::nullopt;
  }
  return hasher.digest().hex() == named.digest ? std::optional(contents) : std::nullopt;
}

/// How two paths differ whose names and contents have different digests.
std::string other_content(const NamedContent& before, const NamedContent& now) {
  const auto old_contents = contents_of(before), contents = contents_of(now);
  if (!old_contents || !contents) return "and the contents differ, or the names";
  return *old_contents == *contents ? "another name for the same content" : "and the contents differ";
}

constexpr std::size_t kMostFunctions = 1000;  // most functions of a node to look at; only a forged record has more

class Comparer {
 public:
  Comparer(const RunRecord& before, const RunRecord& now) : before_(before), now_(now) {
    for (const RecordedNode& node : before.nodes)
      if (const RecordedNode* other = now.find(node.id); other && came_out_otherwise(node, *other))
        differing_.insert(node.id);
    for (const RecordedNode& node : now.nodes)  // in an order in which sources come before the nodes that use them
      if (const RecordedNode* old = before.find(node.id); old && takes_differing(*old, node))
        following_.insert(node.id);
  }

  RunDifference compare() {
    RunDifference result;
    std::set<std::string> explained;
    for (const RecordedNode& node : before_.nodes) {
      const RecordedNode* other = now_.find(node.id);
      if (!other) {
        result.only_before.push_back(node.id);
      } else if (!differing_.contains(node.id)) {
        result.same += node.makes_data() || !functions_differ(node, *other);
      } else if (following_.contains(node.id) || differs_by_pass_before(node, *other)) {
        result.in_consequence.push_back(node.id);
      } else {
        result.roots.push_back({&node, other, reasons_of(node, *other)});
        explained.insert(node.id);
        for (const Change& change : result.roots.back().why) explained.insert(change.node);
      }
    }
    for (const RecordedNode& node : now_.nodes)
      if (!before_.find(node.id)) result.only_now.push_back(node.id);
    add_others(explained, result);
    add_rebuilt(result);
    return result;
  }

 private:
  /// Whether a node has another result. Functions have no content to compare; only their effect on data counts.
  static bool came_out_otherwise(const RecordedNode& before, const RecordedNode& now) {
    if (before.went_well() != now.went_well() || (!now.went_well() && before.status != now.status)) return true;
    if (now.has_failed() && before.reason != now.reason) return true;
    const auto a = before.data(), b = now.data();
    const bool went_well = before.went_well() && !before.is_in_body();  // one of the runs may have more passes
    const bool in_body = before.is_in_body();
    if (a.size() == 1 && b.size() == 1) return is_other(*a[0], *b[0], went_well, in_body);  // their names may differ
    return !std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](const RecordedOutput* x, const RecordedOutput* y) {
      return x->name == y->name && !is_other(*x, *y, went_well, in_body);
    });
  }

  /// Whether an output differs. For nodes that failed or did not run, only the items that exist are compared; for nodes
  /// of a body, only the items that exist in both runs.
  static bool is_other(const RecordedOutput& before, const RecordedOutput& now, bool went_well, bool in_body) {
    if (went_well || before.key == now.key) return before.key != now.key;
    const auto present = [](const RecordedOutput& output) {
      std::map<std::string, std::string> items;
      for (const RecordedItem& item : output.items)
        if (!item.is_absent()) items[item.place] = item.key;
      return items;
    };
    const auto old_items = present(before), items = present(now);
    if (!in_body) return old_items != items;
    return std::any_of(items.begin(), items.end(), [&](const auto& item) {
      const auto old = old_items.find(item.first);
      return old != old_items.end() && old->second != item.second;
    });
  }

  static bool functions_differ(const RecordedNode& before, const RecordedNode& now) {
    return !std::equal(before.outputs.begin(), before.outputs.end(), now.outputs.begin(), now.outputs.end(),
                       [](const RecordedOutput& a, const RecordedOutput& b) { return a.key == b.key; });
  }

  /// Whether an input with the same wire in both runs got another value.
  bool input_differs(const RecordedNode& before, const RecordedNode& now, const std::string& port) const {
    const std::string *a = find_in(before.input_keys, port), *b = find_in(now.input_keys, port);
    return a && b && *a != *b;
  }

  /// Calls visit(port, source before, source now) for each input with the same wire and another value.
  template <class Visit>
  void for_changed_inputs(const RecordedNode& before, const RecordedNode& now, const Visit& visit) const {
    for (const auto& [port, wire] : now.wires) {
      const RecordedWire* old = find_in(before.wires, port);
      if (!old || old->text != wire.text || !input_differs(before, now, port)) continue;
      for (const std::string& id : wire.from)
        if (const RecordedNode* a = before_.find(id), *b = now_.find(id); a && b) visit(port, *a, *b);
    }
  }

  /// Whether the node takes data that differ, directly or through functions that it calls.
  bool takes_differing(const RecordedNode& before, const RecordedNode& now) const {
    bool result = false;
    for_changed_inputs(before, now, [&](const std::string&, const RecordedNode&, const RecordedNode& from) {
      result = result || differing_.contains(from.id) || (!from.makes_data() && following_.contains(from.id));
    });
    return result || has_differing_body(now);
  }

  /// Whether a node of its body differs; the node itself then follows from that.
  bool has_differing_body(const RecordedNode& node) const {
    const std::string body = node.id + "/";
    const auto first = differing_.lower_bound(body);
    return node.uses == "repeat" && first != differing_.end() && first->starts_with(body);
  }

  /// Whether a node of a body differs only because of what the pass before handed on.
  bool differs_by_pass_before(const RecordedNode& before, const RecordedNode& now) const {
    const bool takes_it = std::any_of(now.wires.begin(), now.wires.end(), [&](const auto& wire) {
      const auto& from = wire.second.from_pass_before;
      return std::any_of(from.begin(), from.end(), [&](const std::string& id) { return differing_.contains(id); });
    });
    if (!takes_it) return false;
    std::vector<Change> why;
    std::set<std::string> seen;
    add_reasons(before, now, "", seen, why);
    return why.empty();
  }

  std::vector<Change> reasons_of(const RecordedNode& before, const RecordedNode& now) const {
    std::vector<Change> why;
    std::set<std::string> seen;
    add_reasons(before, now, "", seen, why);
    if (why.empty()) why.push_back(unknown(now.id));
    return why;
  }

  /// `seen`: the functions that were looked at already.
  void add_reasons(const RecordedNode& before, const RecordedNode& now, const std::string& through,
                   std::set<std::string>& seen, std::vector<Change>& why) const {
    const auto add = [&](Change change) {
      change.text = through + change.text;
      why.push_back(std::move(change));
    };
    for (Change& change : own_changes(before, now, true)) add(std::move(change));
    for (Change& change : other_wires(before, now, true)) add(std::move(change));
    for_changed_inputs(
        before, now, [&](const std::string&, const RecordedNode& from_before, const RecordedNode& from_now) {
          if (from_now.makes_data() || seen.size() >= kMostFunctions || !seen.insert(from_now.id).second) return;
          add_reasons(from_before, from_now, "the function of node '" + from_now.id + "', which it calls: ", seen, why);
        });
  }

  std::vector<Change> own_changes(const RecordedNode& before, const RecordedNode& now, bool with_builds) const {
    if (before.uses != now.uses)
      return {{"uses", now.id, "", before.uses, now.uses,
               "it uses " + now.uses + ", used " + before.uses + other_place(before.uses_place, now.uses_place)}};
    std::vector<Change> changes;
    if (with_builds && before.build_id != now.build_id && !before.build_id.empty() && !now.build_id.empty())
      changes.push_back(other_build(before, now));
    for (const std::string& name : names_in(before.options, now.options)) {
      const std::string text = option_change(before, now, name);
      const std::string *a = find_in(before.options, name), *b = find_in(now.options, name);
      if (!text.empty())
        changes.push_back(
            {now.files.contains(name) ? "content" : "option", now.id, name, a ? *a : "", b ? *b : "", text});
    }
    if (with_builds && now.random && before_.seed != now_.seed)
      changes.push_back(seed_change(now.id, "it draws random numbers, and the seed is "));
    return changes;
  }

  Change seed_change(const std::string& node, const std::string& text) const {
    const std::string before = formatted("{}", before_.seed), now = formatted("{}", now_.seed);
    return {"seed", node, "", before, now, text + now + ", was " + before};
  }

  Change other_build(const RecordedNode& before, const RecordedNode& now) const {
    Change change{"plugin", now.id, now.library, before.build_id, now.build_id, ""};
    const std::string ids = build_ids(before.build_id, now.build_id);
    if (before.library != now.library)
      change.text = "it comes from " + now.library + ", came from " + before.library + ids;
    else
      change.text = "its plugin " + now.library + " is another build" + ids;
    if (before_.framework != now_.framework)
      change.text += "; marrow's own library is another build too, which gives every plugin another build id";
    return change;
  }

  /// The change of an option, in words. Empty if it has no effect. A path counts by the content that it names.
  static std::string option_change(const RecordedNode& before, const RecordedNode& now, const std::string& name) {
    const std::string *old_text = find_in(before.options, name), *text = find_in(now.options, name),
                      option = "option '" + name + "'";
    const auto *old_content = find_in(before.files, name), *content = find_in(now.files, name);
    if (old_text && text && old_content && content) {
      if (*old_content == *content) return "";
      if (!*content)
        return *text + " (" + option + ") is not there" + (*old_text == *text ? " any more" : ", was " + *old_text);
      if (!*old_content)
        return *old_text + " (" + option + ") was not there" + (*old_text == *text ? " yet" : ", is " + *text);
      if (*old_text == *text) return "the content of " + file_or_folder(*text) + " (" + option + ") differs";
      return option + " is " + *text + ", was " + *old_text + ", " +
             other_content({*old_text, **old_content}, {*text, **content});
    }
    const std::string old_short = old_text ? shortened(*old_text) : "", now_short = text ? shortened(*text) : "";
    if (old_text && text && old_short == now_short) return "";
    const std::string *old_place = find_in(before.option_places, name), *place = find_in(now.option_places, name);
    return is_was(option, old_text ? &old_short : nullptr, text ? &now_short : nullptr) +
           other_place(old_place ? *old_place : "", place ? *place : "");
  }

  /// Inputs with another wire. With `by_value`, only those that got another value.
  std::vector<Change> other_wires(const RecordedNode& before, const RecordedNode& now, bool by_value) const {
    std::vector<Change> changes;
    for (const std::string& port : names_in(before.wires, now.wires)) {
      const RecordedWire *a = find_in(before.wires, port), *b = find_in(now.wires, port);
      if (a && b && a->text == b->text) continue;
      const std::string *old_key = find_in(before.input_keys, port), *key = find_in(now.input_keys, port);
      if (by_value && old_key && key && *old_key == *key) continue;
      Change change{"wire", now.id, port, a ? a->text : "", b ? b->text : "", "input '" + port + "' is "};
      change.text += b ? "wired to " + b->text + did_not_run(*b, before_) : std::string("not wired");
      change.text += a ? ", was wired to " + a->text + did_not_run(*a, now_) : std::string(", was not wired");
      changes.push_back(std::move(change));
    }
    return changes;
  }

  std::string did_not_run(const RecordedWire& wire, const RunRecord& in) const {
    const bool is_before = &in == &before_;
    for (const std::string& id : wire.from) {
      if (in.find(id)) continue;
      if (in.not_needed.contains(id)) return " (node '" + id + (is_before ? "' was" : "' is") + " not needed)";
      return std::string(" (") + (is_before ? "there was" : "there is") + " no node '" + id + "')";
    }
    return "";
  }

  Change unknown(const std::string& node) const {
    Change change{"unknown", node, "", "", "", ""};
    change.text =
        "nothing that it was made from differs (plugin, options, contents of files, inputs, seed): it does not give "
        "the same result each time";
    if (before_.cpu_level != now_.cpu_level)
      change.text += "; the processor is of another level (" + now_.cpu_level + ", was " + before_.cpu_level + ")";
    if (before_.threads != now_.threads)
      change.text += formatted("; it ran on {} threads, ran on {}", now_.threads, before_.threads);
    return change;
  }

  void add_others(const std::set<std::string>& explained, RunDifference& result) const {
    for (const RecordedNode& node : before_.nodes) {
      const RecordedNode* other = now_.find(node.id);
      if (!other || explained.contains(node.id)) continue;
      for (Change& change : own_changes(node, *other, false)) result.others.push_back(std::move(change));
      for (Change& change : other_wires(node, *other, false)) result.others.push_back(std::move(change));
    }
    const auto is_seed = [](const Change& change) { return change.what == "seed"; };
    const bool is_told = std::any_of(result.roots.begin(), result.roots.end(), [&](const Root& root) {
      return std::any_of(root.why.begin(), root.why.end(), is_seed);
    });
    if (before_.seed != now_.seed && !is_told) result.others.push_back(seed_change("", "the seed is "));
  }

  void add_rebuilt(RunDifference& result) const {
    for (const auto& [file, build_id] : now_.plugins) {
      const std::string* old = find_in(before_.plugins, file);
      if (old && *old != build_id)
        result.rebuilt.push_back({"plugin", "", file, *old, build_id, file + build_ids(*old, build_id)});
    }
  }

  static std::string build_ids(const std::string& before, const std::string& now) {
    return " (build id " + now.substr(0, 8) + ", was " + before.substr(0, 8) + ")";
  }

  const RunRecord& before_;
  const RunRecord& now_;
  std::set<std::string> differing_;  ///< nodes in both runs whose data or status differ
  std::set<std::string> following_;  ///< nodes in both runs that take differing data
};

}  // namespace

RunDifference difference_of(const RunRecord& before, const RunRecord& now) { return Comparer(before, now).compare(); }

}  // namespace marrow::cli
