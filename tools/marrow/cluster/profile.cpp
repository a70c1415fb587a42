// SPDX-License-Identifier: Apache-2.0
#include "cluster/profile.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/base/strict_yaml.hpp"

namespace marrow::cli {
namespace {

const std::vector<std::string> kKeys{"marrow-cluster", "partition", "account",   "processors", "memory_mb",
                                     "minutes",        "modules",   "setup",     "options",    "most_tasks",
                                     "most_at_once",   "tries",     "silence_s", "ask_every_s"};

class ProfileReader {
 public:
  ProfileReader(const std::filesystem::path& file, Diagnostics& diagnostics) : yaml_(file.string(), diagnostics) {}

  ClusterProfile read(const std::string& source, const Place& whole) {
    ClusterProfile profile;
    bool has_version = false;
    for (const YamlEntry& entry : yaml_.map(yaml_.parse(source), whole, "the profile", &kKeys)) {
      const std::string& key = entry.key;
      if (key == "marrow-cluster") has_version = number(entry, 1, 1) == 1;
      if (key == "partition") profile.partition = word(entry.value, entry);
      if (key == "account") profile.account = word(entry.value, entry);
      if (key == "processors") profile.processors = number(entry, 1, 100'000);
      if (key == "memory_mb") profile.memory_mb = number(entry, 1, 100'000'000);
      if (key == "minutes") profile.minutes = number(entry, 1, 1'000'000);
      if (key == "modules") profile.modules = words(entry);
      if (key == "setup") profile.setup = lines(entry);
      if (key == "options") profile.options = lines(entry);
      if (key == "most_tasks") profile.most_tasks = number(entry, 1, 1'000'000);
      if (key == "most_at_once") profile.most_at_once = number(entry, 1, 1'000'000);
      if (key == "tries") profile.tries = number(entry, 1, 100);
      if (key == "silence_s") profile.silence_s = number(entry, 1, 1'000'000);
      if (key == "ask_every_s") profile.ask_every_s = number(entry, 1, 3600);
    }
    if (!has_version) yaml_.fault(whole, "the profile lacks 'marrow-cluster: 1'");
    return profile;
  }

 private:
  std::int64_t number(const YamlEntry& entry, std::int64_t least, std::int64_t most) {
    const auto value = yaml_.integer(entry.value, entry.place, "'" + entry.key + "'");
    if (value && *value >= least && *value <= most) return *value;
    if (value)
      yaml_.fault(entry.place, formatted("'{}' must be from {} to {}, got {}", entry.key, least, most, *value));
    return least;
  }

  std::vector<std::string> lines(const YamlEntry& entry) {
    std::vector<std::string> all;
    if (!entry.value.IsSequence())
      yaml_.fault(entry.place, "'" + entry.key + "' must be a list of texts");
    else
      for (const YAML::Node& one : entry.value)
        if (auto text = yaml_.text(one, yaml_.place(one), "an item of '" + entry.key + "'")) {
          if (text->find_first_of("\n\r") != std::string::npos)
            yaml_.fault(yaml_.place(one), "an item of '" + entry.key + "' must be one line");
          all.push_back(std::move(*text));
        }
    return all;
  }

  /// The name of a partition, account or module. It becomes part of a line of shell, so only harmless characters are
  /// allowed.
  std::string word(const YAML::Node& node, const YamlEntry& entry) {
    const auto text = yaml_.text(node, entry.place, "'" + entry.key + "'");
    const char* allowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.,:/+@-";
    if (text && (text->empty() || text->find_first_not_of(allowed) != std::string::npos))
      yaml_.fault(entry.place,
                  "'" + entry.key + "' may hold letters, digits and _ . , : / + @ - only, got '" + *text + "'");
    return text.value_or("");
  }
  std::vector<std::string> words(const YamlEntry& entry) {
    std::vector<std::string> all = lines(entry);
    for (const YAML::Node& one : entry.value)
      if (entry.value.IsSequence()) word(one, entry);
    return all;
  }

  StrictYaml yaml_;
};

}  // namespace

ClusterProfile read_profile(const std::filesystem::path& file, Diagnostics& diagnostics) {
  const auto source = read_source(file, "the cluster's profile", diagnostics);
  if (!source) return {};
  return ProfileReader(file, diagnostics).read(*source, Place{file.string(), 1, 1});
}

}  // namespace marrow::cli
