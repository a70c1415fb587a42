// SPDX-License-Identifier: Apache-2.0
#include <glob.h>

#include <cstdio>

#include "draw.hpp"
#include "experiment_text.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

/// As the section 'simulate' says how.
struct Simulation {
  std::vector<std::uint64_t> seeds;
  std::vector<InputValue> inputs;
  std::vector<DrawnInput> drawn;
  PlacedTexts seed_inputs;
};

class CaseReader {
 public:
  CaseReader(StrictYaml& yaml, const fs::path& folder, WrittenExperiment& written)
      : yaml_(yaml), folder_(folder), written_(written), experiment_(written.experiment) {}

  void read(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"input", "folders", "simulate"};
    experiment_.case_input = "case";
    experiment_.cases_place = section.place;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'cases'", &kKeys)) {
      if (entry.key == "input") experiment_.case_input = yaml_.text(entry.value, entry.place, "input").value_or("");
      if (entry.key == "folders")
        for (const auto& [pattern, place] : texts_of(yaml_, entry)) add_folders(pattern, place);
      if (entry.key == "simulate") read_simulation(entry);
    }
  }

 private:
  void add(ExperimentCase one, const Place& place) {
    for (const ExperimentCase& other : experiment_.cases)
      if (other.name == one.name) {
        yaml_.fault(place, "two cases are named '" + one.name + "'",
                    one.folder.empty() ? "give each seed once" : other.folder.empty() ? "rename the folder" : "they are " + other.folder.string() + " and " + one.folder.string());
        return;
      }
    experiment_.cases.push_back(std::move(one));
  }

  void add_folders(const std::string& pattern, const Place& place) {
    glob_t found{};
    bool any = false;
    const int status = glob((folder_ / pattern).lexically_normal().c_str(), 0, nullptr, &found);
    for (std::size_t i = 0; status == 0 && i < found.gl_pathc; ++i) {
      fs::path folder = found.gl_pathv[i];
      if (folder.filename() == "case.yaml" || folder.filename().empty()) folder = folder.parent_path();
      std::error_code error;
      if (!fs::is_directory(folder, error)) continue;  // what else lies among the cases
      any = true;
      add({folder.filename().string(), folder, 1, {}}, place);
    }
    globfree(&found);
    if (!any) yaml_.fault(place, "there is no folder at '" + pattern + "'", "the path starts at the experiment's file");
  }

  void read_simulation(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"pipeline", "output", "set", "seeds", "inputs", "draw", "seed_input"};
    Simulation simulation;
    bool has_pipeline = false, has_seeds = false;
    experiment_.simulation_output = "case";
    written_.simulation_place = section.place;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'simulate'", &kKeys)) {
      has_pipeline |= entry.key == "pipeline";
      has_seeds |= entry.key == "seeds";
      if (entry.key == "pipeline") experiment_.simulation = file_of(yaml_, entry, folder_);
      if (entry.key == "output") {
        experiment_.simulation_output = yaml_.text(entry.value, entry.place, "output").value_or("");
        written_.simulation_place = entry.place;
      }
      if (entry.key == "set") experiment_.simulation_changes = patches_of(yaml_, entry, "'set'");
      if (entry.key == "seeds") simulation.seeds = read_seeds(entry);
      if (entry.key == "inputs") simulation.inputs = inputs_of(yaml_, entry);
      if (entry.key == "draw")
        for (const YamlEntry& range : yaml_.map(entry.value, entry.place, "'draw'")) simulation.drawn.push_back({range.key, read_range(range), range.place});
      if (entry.key == "seed_input") simulation.seed_inputs = texts_of(yaml_, entry);
    }
    if (!section.value.IsMap()) return;
    if (!has_pipeline) yaml_.fault(section.place, "'simulate' does not name its pipeline", "add  pipeline: ../simulate.yaml");
    if (!has_seeds) yaml_.fault(section.place, "'simulate' does not say which seeds", "add  seeds: 1..20  or a list");
    for (const std::uint64_t seed : simulation.seeds) add_simulated(simulation, seed, section.place);
  }

  void add_simulated(const Simulation& simulation, std::uint64_t seed, const Place& place) {
    ExperimentCase one{"seed-" + std::to_string(seed), {}, seed, simulation.inputs};
    for (InputValue& input : draw_inputs(simulation.drawn, seed)) one.inputs.push_back(std::move(input));
    for (const auto& [name, where] : simulation.seed_inputs) one.inputs.push_back({name, std::to_string(seed), where});
    add(std::move(one), place);
  }

  /// "1..20" or a list of integers.
  std::vector<std::uint64_t> read_seeds(const YamlEntry& entry) {
    std::vector<std::uint64_t> seeds;
    if (entry.value.IsScalar()) {
      long long first = 0, last = 0;
      int used = 0;
      const std::string text = entry.value.Scalar();
      const bool is_range = std::sscanf(text.c_str(), "%lld..%lld%n", &first, &last, &used) == 2 && used == int(text.size());
      if (is_range && first >= 0 && first <= last && last - first < 100000) {
        for (long long seed = first; seed <= last; ++seed) seeds.push_back(std::uint64_t(seed));
        return seeds;
      }
    } else if (entry.value.IsSequence() && entry.value.size() > 0) {
      for (const YAML::Node& item : entry.value) {
        const auto seed = yaml_.integer(item, yaml_.place(item), "a seed");
        if (seed && *seed < 0) yaml_.fault(yaml_.place(item), "a seed must be 0 or more, got " + std::to_string(*seed));
        if (seed && *seed >= 0) seeds.push_back(std::uint64_t(*seed));
      }
      return seeds;
    }
    yaml_.fault(entry.place, "'seeds' must be a range such as 1..20, of at most 100000, or a list of integers");
    return seeds;
  }

  std::array<double, 2> read_range(const YamlEntry& entry) {
    std::array<double, 2> range{};
    if (!entry.value.IsSequence() || entry.value.size() != 2) {
      yaml_.fault(entry.place, "'" + entry.key + "' must be the two ends of a range", "write it as  " + entry.key + ": [-10, 10]");
      return range;
    }
    for (std::size_t i = 0; i < 2; ++i) range[i] = yaml_.number(entry.value[i], yaml_.place(entry.value[i]), entry.key).value_or(0);
    if (range[0] > range[1]) yaml_.fault(entry.place, "the range of '" + entry.key + "' ends before it begins");
    return range;
  }

  StrictYaml& yaml_;
  const fs::path& folder_;
  WrittenExperiment& written_;
  Experiment& experiment_;
};

}  // namespace

void read_cases(StrictYaml& yaml, const YamlEntry& section, const fs::path& folder, WrittenExperiment& written) {
  CaseReader(yaml, folder, written).read(section);
}

}  // namespace marrow::compare
