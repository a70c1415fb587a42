// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "command_options.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/store/shared_store.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

struct Share {
  std::size_t entries = 0;
  std::uint64_t bytes = 0;
  double seconds = 0;
};

/// The exit code of the command. Prints the fault if there is one.
int code_after(const std::string& fault) {
  if (!fault.empty()) std::fprintf(stderr, "marrow: error: %s\n", printable_lines(fault).c_str());
  return fault.empty() ? 0 : 2;
}

double megabytes(std::uint64_t bytes) { return double(bytes) / 1e6; }

void print(const Store::Entry& entry) {
  const Provenance& from = entry.provenance;
  std::printf("%s: %s, %.2f MB, took %.3f s\n  build id %s\n", entry.key.hex().c_str(), printable(from.node).c_str(),
              megabytes(entry.bytes), from.seconds, from.build_id.hex().c_str());
  for (const auto& [name, value] : from.options)
    std::printf("  option %-24s %s\n", printable(name).c_str(), printable(value).c_str());
  for (const auto& [name, digest] : from.inputs)
    std::printf("  input  %-24s %s\n", printable(name).c_str(), digest.hex().c_str());
  for (const Digest& digest : entry.outputs) std::printf("  output %s\n", digest.hex().c_str());
  if (from.random) std::printf("  seed   %llu\n", static_cast<unsigned long long>(from.seed));
  for (const std::string& warning : from.warnings) std::printf("  warning: %s\n", printable_lines(warning).c_str());
}

json json_of(const Store::Entry& entry) {
  const Provenance& from = entry.provenance;
  json j = {{"key", entry.key.hex()},
            {"node", from.node},
            {"bytes", entry.bytes},
            {"seconds", from.seconds},
            {"build_id", from.build_id.hex()},
            {"options", from.options},
            {"inputs", json::object()},
            {"outputs", json::array()},
            {"warnings", from.warnings}};
  for (const auto& [name, digest] : from.inputs) j["inputs"][name] = digest.hex();
  for (const Digest& digest : entry.outputs) j["outputs"].push_back(digest.hex());
  if (from.random) j["seed"] = from.seed;
  return j;
}

/// The message that several keys begin with `key`, with some of them.
std::string several(const std::string& key, const std::set<std::string>& keys) {
  constexpr std::size_t kMostShown = 5;
  std::string text = formatted("{} keys begin with '{}'; give more digits of one of them:", keys.size(), key);
  std::size_t shown = 0;
  for (const std::string& one : keys)
    if (shown++ < kMostShown) text += "\n" + one;
  return keys.size() > kMostShown ? text + "\n..." : text;
}

/// What is kept, by the name of the node, and all together. Damaged entries have no name.
struct Shares {
  std::map<std::string, Share> of_nodes;
  Share all;

  explicit Shares(const std::vector<Store::Entry>& entries) {
    for (const Store::Entry& entry : entries)
      for (Share* share : {&of_nodes[entry.provenance.node], &all}) {
        ++share->entries;
        share->bytes += entry.bytes;
        share->seconds += entry.provenance.seconds;
      }
  }
};

json json_of(const std::filesystem::path& folder, const Shares& shares) {
  const auto told = [](const Share& share) {
    return json{{"results", share.entries}, {"bytes", share.bytes}, {"seconds", share.seconds}};
  };
  json nodes = json::object();
  for (const auto& [name, share] : shares.of_nodes) nodes[name] = told(share);
  return {{"folder", folder.string()}, {"nodes", nodes}, {"all", told(shares.all)}};
}

void print_shares(const std::string& folder, const Shares& shares) {
  std::printf("%s\n\n%-34s %8s %12s %12s\n", printable(folder).c_str(), "node", "results", "MB", "seconds");
  const auto print = [](const std::string& name, const Share& share) {
    std::printf("%-34s %8zu %12.2f %12.2f\n", printable(name).c_str(), share.entries, megabytes(share.bytes),
                share.seconds);
  };
  for (const auto& [name, share] : shares.of_nodes)
    print(name.empty() ? "(damaged or of another version)" : name, share);
  print("all", shares.all);
}

int cache_info(bool as_json) {
  const Store store;
  if (const int code = code_after(store.fault())) return code;
  const std::string fault_of_shared = store.shared() ? store.shared()->fault() : "";
  const Shares shares(store.entries());
  if (!as_json) print_shares(store.folder().string(), shares);
  if (const int code = code_after(fault_of_shared)) return code;
  json told = json_of(store.folder(), shares);
  if (store.shared()) {
    const Shares shared(store.shared()->entries());
    told["shared"] = json_of(store.shared()->folder(), shared);
    if (!as_json) std::printf("\n");
    if (!as_json) print_shares(store.shared()->folder().string() + " (shared)", shared);
  }
  if (as_json) print_as_json(told);
  return 0;
}

int cache_why(const std::string& key, bool as_json) {
  const Store store;
  if (const int code = code_after(store.fault())) return code;
  std::vector<Store::Entry> meant;
  std::set<std::string> keys;  // several results may have the same output
  std::vector<Store::Entry> entries = store.entries();
  if (store.shared())
    for (Store::Entry& entry : store.shared()->entries())
      if (std::none_of(entries.begin(), entries.end(), [&](const auto& one) { return one.key == entry.key; }))
        entries.push_back(std::move(entry));
  for (Store::Entry& entry : entries) {
    std::vector<Digest> all = entry.outputs;
    all.push_back(entry.key);
    std::erase_if(all, [&](const Digest& digest) { return !digest.hex().starts_with(key); });
    for (const Digest& digest : all) keys.insert(digest.hex());
    if (!all.empty()) meant.push_back(std::move(entry));
  }
  if (keys.empty())
    return code_after("the store " + store.folder().string() +
                      (store.shared() ? ", or the shared one " + store.shared()->folder().string() + "," : "") +
                      " holds no result with a key that begins with '" + key + "'");
  if (keys.size() > 1) return code_after(several(key, keys));
  int code = 0;
  json told = json::array();
  for (const Store::Entry& entry : meant) {
    if (!entry.provenance.node.empty() && as_json)
      told.push_back(json_of(entry));
    else if (!entry.provenance.node.empty())
      print(entry);
    else
      code = code_after("the result " + entry.key.hex() +
                        " is damaged or of another version; the next run that needs it makes it again");
  }
  if (as_json) print_as_json(told);
  return code;
}

int cache_collect(double keep_gb, bool is_shared, bool as_json) {
  const Store store;
  if (is_shared && !store.shared())
    return code_after("there is no shared store: MARROW_SHARED_CACHE is not set; nothing is removed");
  const std::uint64_t keep_bytes = std::uint64_t(keep_gb * 1e9);
  const Store::Freed freed = is_shared ? store.shared()->collect(keep_bytes) : store.collect(keep_bytes);
  if (as_json)
    print_as_json({{"removed", freed.entries}, {"bytes", freed.bytes}});
  else if (freed.fault.empty() || freed.entries)
    std::printf("%zu results removed, %.2f MB freed\n", freed.entries, megabytes(freed.bytes));
  return code_after(freed.fault);
}

}  // namespace

void add_cache(CLI::App& app, int& code) {
  struct Given {
    std::string key;
    double keep_gb = 10;
    bool is_shared = false, as_json = false;
  };
  const auto given = std::make_shared<Given>();
  CLI::App* command =
      app.add_subcommand("cache",
                         "look at the store of results (MARROW_CACHE, else marrow/store in "
                         "XDG_CACHE_HOME or ~/.cache) and at the shared one (MARROW_SHARED_CACHE), and tidy them up");
  command->require_subcommand(1);
  CLI::App* info = command->add_subcommand("info", "how much is kept, and of which nodes");
  info->callback([given, &code] { code = cache_info(given->as_json); });
  CLI::App* why = command->add_subcommand("why", "what a kept result was made from");
  why->add_option("key", given->key,
                  "key of a result or of one of its outputs (run.json shows those), or its first digits")
      ->required();
  why->callback([given, &code] { code = cache_why(given->key, given->as_json); });
  CLI::App* gc = command->add_subcommand("gc", "remove the least recently used results");
  const auto take_keep_gb = [given](const std::string& text) {
    given->keep_gb = number("--keep-gb", text, 0, 1e6, "gigabytes", "; nothing is removed");
  };
  show_default(gc->add_option_function<std::string>("--keep-gb", take_keep_gb, "size to keep, in gigabytes")
                   ->type_name("NUMBER"),
               given->keep_gb);
  gc->add_flag("--shared", given->is_shared, "of the shared store, instead of this host's");
  gc->callback([given, &code] { code = cache_collect(given->keep_gb, given->is_shared, given->as_json); });
  for (CLI::App* one : {info, why, gc}) one->add_flag("--json", given->as_json, "as JSON");
}

}  // namespace marrow::cli
