// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <fnmatch.h>
#include <algorithm>
#include <charconv>
#include <climits>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "experiment_sections.hpp"
#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::compare {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostSeeds = 100000;

/// Reads a range such as "1..20". Returns false for any other text.
bool read_range_of_seeds(const std::string& text, std::uint64_t& first, std::uint64_t& last) {
  const char* const end = text.data() + text.size();
  const auto begin = std::from_chars(text.data(), end, first);
  if (begin.ec != std::errc() || end - begin.ptr < 3 || begin.ptr[0] != '.' || begin.ptr[1] != '.') return false;
  const auto rest = std::from_chars(begin.ptr + 2, end, last);
  return rest.ec == std::errc() && rest.ptr == end && last <= std::uint64_t(INT64_MAX);
}

/// Whether a name of a path holds a wildcard.
bool is_pattern(const std::string& name) { return name.find_first_of("*?[\\") != std::string::npos; }

/// Finds the paths that match a pattern such as data/*/ct. Unlike glob(3), it says what it could not read, and it ends
/// even if links form a circle.
class FolderSearch {
 public:
  /// The existing paths that match `pattern`, sorted. The search starts at `folder`, whose name is not a pattern even
  /// if it holds a '*'. A name that begins with a dot is matched only by a pattern that begins with a dot. Throws Error
  /// if a folder cannot be read, if the path is longer than any may be, or if all calls together have looked at more
  /// than kMostLookedAt files and folders.
  std::vector<fs::path> matches(const fs::path& folder, const fs::path& pattern) {
    if (const std::size_t size = (folder / pattern).native().size(); size >= PATH_MAX)
      throw Error(formatted("the path has {} bytes, more than any path may have", size));
    std::vector<fs::path> found{pattern.is_absolute() ? pattern.root_path() : folder};
    for (const fs::path& part : pattern.relative_path()) {
      if (part.empty()) continue;  // the part after a slash at the end
      std::vector<fs::path> next;
      for (const fs::path& one : found) {
        if (is_pattern(part.string())) {
          for (fs::path& match : inside(one, part.string())) next.push_back(std::move(match));
          continue;
        }
        look();
        std::error_code error;
        if (fs::symlink_status(one / part, error).type() != fs::file_type::not_found) next.push_back(one / part);
      }
      found = std::move(next);
    }
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  static constexpr std::size_t kMostLookedAt = 300000;

  std::vector<fs::path> inside(const fs::path& folder, const std::string& name) {
    std::vector<fs::path> found;
    std::error_code error;
    if (!fs::is_directory(folder, error)) return found;
    fs::directory_iterator at(folder, error);
    for (const fs::directory_iterator end; !error && at != end; at.increment(error)) {
      look();
      if (fnmatch(name.c_str(), at->path().filename().c_str(), FNM_PERIOD) == 0) found.push_back(at->path());
    }
    if (error) throw Error("the folder " + folder.string() + " cannot be read: " + error.message());
    return found;
  }

  void look() {
    if (++looked_at_ > kMostLookedAt)
      throw Error(formatted("the search goes through more than {} files and folders; do links lead in a circle?",
                            kMostLookedAt));
  }

  std::size_t looked_at_ = 0;
};

class CaseReader {
 public:
  CaseReader(StrictYaml& yaml, WrittenExperiment& written)
      : yaml_(yaml), written_(written), experiment_(written.experiment) {}

  void read(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"input", "folders", "seeds", "simulate", "draw", "seed_input"};
    experiment_.case_input = "case";
    experiment_.cases_place = section.place;
    const std::vector<YamlEntry> entries = yaml_.map(section.value, section.place, "'cases'", &kKeys);
    const auto has = [&](std::string_view key) {
      return std::any_of(entries.begin(), entries.end(), [&](const YamlEntry& entry) { return entry.key == key; });
    };
    for (const YamlEntry& entry : entries) {
      if (entry.key == "seeds" && (has("input") || has("folders") || has("simulate")))
        yaml_.fault(
            entry.place, "'seeds' beside other cases",
            "by themselves they mean that the pipeline makes its data; those of a simulation stand in 'simulate'");
      if (entry.key == "input") experiment_.case_input = yaml_.text(entry.value, entry.place, "input").value_or("");
      if (entry.key == "folders")
        for (const auto& [pattern, place] : texts_of(yaml_, entry)) add_folders(pattern, place);
      if (entry.key == "seeds") add_seeds(read_seeds(entry), false, entry.place);
      if (entry.key == "simulate") read_simulation(entry);
      if (!read_seeded(entry, experiment_.seeded) || has("seeds")) continue;
      yaml_.fault(entry.place, "'" + entry.key + "' without 'seeds'",
                  "inputs of a simulation that differ between cases stand in 'simulate'");
    }
    if (experiment_.more_cases && !has_more_)
      yaml_.fault(section.place, "further cases need seeds, which these cases do not have",
                  "use  cases: {simulate: ...}  or  {seeds: 1..20}");
  }

 private:
  /// Returns false and reports a fault if the case cannot be added. The rest of the same list is then ignored.
  bool add(ExperimentCase one, const Place& place) {
    if (!check_name(yaml_, one.name, place, "a case's name") || !is_new_folder(one, place)) return false;
    const auto [known, is_new] = known_.emplace(in_small_letters(one.name), experiment_.cases.size());
    if (is_new) {
      experiment_.cases.push_back(std::move(one));
      return true;
    }
    const ExperimentCase& other = experiment_.cases[known->second];
    const std::string names =
        "'" + one.name + "'" +
        (other.name == one.name ? "" : " and '" + other.name + "', which is one folder to some file systems");
    yaml_.fault(place, "two cases are named " + names,
                one.folder.empty() ? "give each seed once"
                : other.folder.empty()
                    ? "rename the folder"
                    : "they are " + printable(other.folder.string()) + " and " + printable(one.folder.string()));
    return false;
  }

  /// Two names may lead to one folder, by a link for example. Each of its runs would then count twice.
  bool is_new_folder(const ExperimentCase& one, const Place& place) {
    struct stat info {};
    if (one.folder.empty() || stat(one.folder.c_str(), &info) != 0) return true;
    const auto [known, is_new] = known_folders_.emplace(std::pair(info.st_dev, info.st_ino), one);
    const ExperimentCase& other = known->second;
    if (is_new || other.name == one.name) return true;  // add() refuses two cases of one name
    yaml_.fault(place,
                "the cases '" + other.name + "' and '" + one.name + "' are one folder, " +
                    printable(other.folder.string()) + ", to which " + printable(one.folder.string()) + " leads",
                "leave one of them out, or its runs count twice");
    return false;
  }

  void add_seeds(std::vector<std::uint64_t> seeds, bool are_simulated, const Place& place) {
    for (std::size_t i = 0; !seeds.empty() && i < experiment_.more_cases; ++i) {
      seeds.push_back(i ? seeds.back() + 1 : *std::max_element(seeds.begin(), seeds.end()) + 1);
      has_more_ = true;
    }
    for (const std::uint64_t seed : seeds)
      if (!add({formatted("seed-{}", seed), {}, are_simulated, seed}, place)) return;
  }

  void add_folders(const std::string& pattern, const Place& place) {
    if (pattern.empty())
      return yaml_.fault(place, "a folder of 'folders' is empty", "name a folder; that of the experiment's file is  .");
    std::vector<fs::path> found;
    try {
      found = search_.matches(folder_of(place), pattern);
      // With '..' after a '*', the same folder is found many times.
      std::transform(found.begin(), found.end(), found.begin(), plain_path);
      std::sort(found.begin(), found.end());
      found.erase(std::unique(found.begin(), found.end()), found.end());
    } catch (const Error& error) {
      return yaml_.fault(place, "the cases at '" + (pattern.size() > 100 ? pattern.substr(0, 80) + "..." : pattern) +
                                    "' cannot be found: " + error.what());
    }
    bool any = false;
    const std::size_t below = parts_below_last_wildcard(pattern);
    for (fs::path& folder : found) {
      fs::path named = folder;
      for (std::size_t i = 0; i < below; ++i) named = named.parent_path();
      if (folder.filename() == "case.yaml") folder = folder.parent_path();
      if (named.filename() == "case.yaml") named = folder;
      std::error_code error;
      if (fs::is_directory(folder, error)) {
        any = true;
        const std::string name = named.filename().string();
        if (!add({fault_of_name(name).empty() ? name : file_name_of(name), folder}, place)) return;
      } else if (fs::is_symlink(folder, error)) {  // a broken link may have been a case; other files are ignored
        if (fs::exists(folder, error)) continue;
        return yaml_.fault(place, "the link " + printable(folder.string()) + " leads nowhere",
                           "remove it, or put its target back");
      } else if (fs::status(folder, error).type() == fs::file_type::none) {
        return yaml_.fault(place, printable(folder.string()) + " cannot be looked at: " + error.message());
      }
    }
    if (!any) yaml_.fault(place, "there is no folder at '" + pattern + "'", "the path starts at the experiment's file");
  }

  /// The number of names after the last one with a wildcard: 1 for "patients/*/case", whose cases are named after the
  /// patients. 0 if there is none, or if '..' leads elsewhere.
  static std::size_t parts_below_last_wildcard(const fs::path& pattern) {
    std::size_t below = 0;
    bool has_wildcard = false;
    for (const fs::path& part : pattern) {
      if (part == "..") return 0;
      if (part.empty() || part == ".") continue;
      const bool is_wildcard = is_pattern(part.string());
      has_wildcard |= is_wildcard;
      below = is_wildcard ? 0 : below + 1;
    }
    return has_wildcard ? below : 0;
  }

  void read_simulation(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"pipeline", "output", "set", "seeds", "inputs", "draw", "seed_input"};
    CaseSimulation& simulation = experiment_.simulation;
    std::vector<std::uint64_t> seeds;
    bool has_pipeline = false, has_seeds = false;
    simulation.output = "case";
    written_.simulation_place = section.place;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'simulate'", &kKeys)) {
      has_pipeline |= entry.key == "pipeline";
      has_seeds |= entry.key == "seeds";
      if (entry.key == "pipeline") simulation.pipeline = file_of(yaml_, entry);
      if (entry.key == "output") {
        simulation.output = yaml_.text(entry.value, entry.place, "output").value_or("");
        written_.simulation_place = entry.place;
      }
      if (entry.key == "set") simulation.changes = patches_of(yaml_, entry, "'set'");
      if (entry.key == "seeds") seeds = read_seeds(entry);
      if (entry.key == "inputs") simulation.inputs = inputs_of(yaml_, entry);
      read_seeded(entry, simulation.seeded);
    }
    if (!section.value.IsMap()) return;
    if (!has_pipeline)
      yaml_.fault(section.place, "'simulate' does not name its pipeline", "add  pipeline: ../simulate/simulate.yaml");
    if (!has_seeds) yaml_.fault(section.place, "'simulate' does not say which seeds", "add  seeds: 1..20  or a list");
    add_seeds(seeds, true, section.place);
  }

  /// Whether an entry says which inputs differ between cases.
  bool read_seeded(const YamlEntry& entry, SeededInputs& seeded) {
    if (entry.key == "draw")
      for (const YamlEntry& range : yaml_.map(entry.value, entry.place, "'draw'"))
        seeded.drawn.push_back(read_drawn(range));
    if (entry.key == "seed_input") seeded.taking_seed = texts_of(yaml_, entry);
    return entry.key == "draw" || entry.key == "seed_input";
  }

  /// "1..20" or a list of integers.
  std::vector<std::uint64_t> read_seeds(const YamlEntry& entry) {
    std::vector<std::uint64_t> seeds;
    if (entry.value.IsScalar()) {
      std::uint64_t first = 0, last = 0;
      if (read_range_of_seeds(entry.value.Scalar(), first, last) && first <= last && last - first < kMostSeeds) {
        for (std::uint64_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
        return seeds;
      }
    } else if (entry.value.IsSequence() && entry.value.size() > 0) {
      for (const YAML::Node& item : entry.value) {
        const auto seed = yaml_.integer(item, yaml_.place(item), "a seed");
        if (seed && *seed < 0) yaml_.fault(yaml_.place(item), formatted("a seed must be 0 or more, got {}", *seed));
        if (seed && *seed >= 0) seeds.push_back(std::uint64_t(*seed));
      }
      return seeds;
    }
    yaml_.fault(entry.place, "'seeds' must be a range such as 1..20, of at most 100000, or a list of integers");
    return seeds;
  }

  /// The two ends of a range, or {range: [...], whole: true}.
  DrawnInput read_drawn(const YamlEntry& entry) {
    static const std::vector<std::string> kKeys{"range", "whole"};
    DrawnInput input{entry.key, {}, entry.place};
    if (!entry.value.IsMap()) {
      input.range = read_range(entry);
      return input;
    }
    bool has_range = false;
    for (const YamlEntry& part : yaml_.map(entry.value, entry.place, "'" + entry.key + "'", &kKeys)) {
      if (part.key == "whole") input.is_whole = yaml_.boolean(part.value, part.place, "whole").value_or(false);
      if (part.key != "range") continue;
      has_range = true;
      input.range = read_range({entry.key, part.place, part.value});
    }
    if (!has_range) yaml_.fault(entry.place, "'" + entry.key + "' has no range", "add  range: [-10, 10]");
    return input;
  }

  std::array<double, 2> read_range(const YamlEntry& entry) {
    std::array<double, 2> range{};
    if (!entry.value.IsSequence() || entry.value.size() != 2) {
      yaml_.fault(entry.place, "'" + entry.key + "' must be the two ends of a range",
                  "write it as  " + entry.key + ": [-10, 10]");
      return range;
    }
    for (std::size_t i = 0; i < 2; ++i)
      range[i] = yaml_.number(entry.value[i], yaml_.place(entry.value[i]), entry.key).value_or(0);
    if (range[0] > range[1]) yaml_.fault(entry.place, "the range of '" + entry.key + "' ends before it begins");
    if (!std::isfinite(range[1] - range[0]))
      yaml_.fault(entry.place, "the range of '" + entry.key + "' is too wide for a number to be drawn from it");
    return range;
  }

  StrictYaml& yaml_;
  WrittenExperiment& written_;
  Experiment& experiment_;
  std::map<std::string, std::size_t> known_;  ///< cases by their names in small letters
  std::map<std::pair<dev_t, ino_t>, ExperimentCase> known_folders_;
  FolderSearch search_;
  bool has_more_ = false;
};

}  // namespace

void read_cases(StrictYaml& yaml, const YamlEntry& section, WrittenExperiment& written) {
  CaseReader(yaml, written).read(section);
}

}  // namespace marrow::compare
