// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/experiment.hpp"

#include <glob.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

#include "random.hpp"
#include "runtime/strict_yaml.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& file, bool& readable) {
  std::ifstream stream(file, std::ios::binary);
  readable = bool(stream) && !fs::is_directory(file);
  std::ostringstream text;
  if (readable) text << stream.rdbuf();
  return text.str();
}

/// A number as it is written on the command line.
std::string number_text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

class Reader {
 public:
  Reader(const fs::path& file, const Catalogue& catalogue, Diagnostics& diagnostics)
      : catalogue_(catalogue), diagnostics_(diagnostics), yaml_(file.string(), diagnostics) {
    experiment_.file = file;
    folder_ = fs::absolute(file).parent_path();
  }

  Experiment read() {
    bool readable = false;
    experiment_.text = read_text(experiment_.file, readable);
    if (!readable) {
      diagnostics_.add({experiment_.file.string()}, "the experiment file cannot be read", "check the path");
      return experiment_;
    }
    diagnostics_.remember(experiment_.file.string(), experiment_.text);
    const YAML::Node root = yaml_.parse(experiment_.text);
    if (!diagnostics_.empty()) return experiment_;
    read_root(root);
    if (diagnostics_.empty()) check_pipelines();
    return experiment_;
  }

 private:
  void read_root(const YAML::Node& root) {
    static const std::vector<std::string> kKeys{"experiment", "name", "help", "pipeline", "inputs", "set", "cases", "variants", "matrix",
                                                "starts", "metrics", "success", "initial_error", "baseline", "pictures", "timed_cells"};
    const Place start{experiment_.file.string(), 1, 1};
    const std::vector<YamlEntry> entries = yaml_.map(root, start, "the experiment", &kKeys);
    if (!root.IsMap()) return;
    experiment_.name = experiment_.file.stem().string();
    for (const YamlEntry& entry : entries) read_entry(entry);
    const auto has = [&](const std::string& key) { return std::any_of(entries.begin(), entries.end(), [&](const YamlEntry& e) { return e.key == key; }); };
    if (!has("experiment")) yaml_.fault(start, "the key 'experiment' is missing", "begin the file with  experiment: 1");
    if (!has("pipeline")) yaml_.fault(start, "the key 'pipeline' is missing", "name the pipeline file whose variants are compared");
    if (!has("cases")) yaml_.fault(start, "the key 'cases' is missing", "say on which data, as  cases: {folders: [...]}  or  cases: {simulate: ...}");
    if (!has("metrics")) yaml_.fault(start, "the key 'metrics' is missing", "name the figures to compare, as  metrics: [errors.distal.final.mtre_mm]");
    apply_matrix();
    if (experiment_.variants.empty() && diagnostics_.empty())
      yaml_.fault(start, "there are no variants", "name at least one under  variants:  or options under  matrix:");
    for (const auto& [path, value, place] : success_) set_success(path, value, place);
    set_baseline();
    draw_starts();
  }

  void read_entry(const YamlEntry& entry) {
    const auto text = [&] { return yaml_.text(entry.value, entry.place, entry.key).value_or(""); };
    if (entry.key == "experiment") {
      const auto version = yaml_.integer(entry.value, entry.place, "experiment");
      if (version && *version != 1)
        yaml_.fault(entry.place, "this file is of format " + std::to_string(*version) + ", this program reads format 1");
    }
    if (entry.key == "name") experiment_.name = text();
    if (entry.key == "help") experiment_.help = text();
    if (entry.key == "pipeline") experiment_.pipeline = (folder_ / text()).lexically_normal();
    if (entry.key == "inputs") experiment_.inputs = scalars(entry);
    if (entry.key == "set") experiment_.common = overrides(entry, "'set'");
    if (entry.key == "cases") read_cases(entry);
    if (entry.key == "variants")
      for (const YamlEntry& variant : yaml_.map(entry.value, entry.place, "variants")) {
        check_name(variant.key, variant.place, "a variant's name");
        experiment_.variants.push_back({variant.key, variant.place, overrides(variant, "variant '" + variant.key + "'")});
      }
    if (entry.key == "matrix") read_matrix(entry);
    if (entry.key == "starts") read_starts(entry);
    if (entry.key == "metrics") read_metrics(entry);
    if (entry.key == "success")
      for (const YamlEntry& limit : yaml_.map(entry.value, entry.place, "success"))
        if (const auto value = yaml_.number(limit.value, limit.place, limit.key)) success_.emplace_back(limit.key, *value, limit.place);
    if (entry.key == "initial_error") {
      experiment_.initial_error = text();
      initial_place_ = entry.place;
    }
    if (entry.key == "baseline") {
      baseline_ = text();
      baseline_place_ = entry.place;
    }
    if (entry.key == "pictures")
      for (const auto& [name, place] : texts(entry)) {
        experiment_.pictures.push_back(name);
        picture_places_.push_back(place);
      }
    if (entry.key == "timed_cells") experiment_.timed_cells = count(entry, 0, 1000);
  }

  std::size_t count(const YamlEntry& entry, std::int64_t least, std::int64_t most) {
    const auto value = yaml_.integer(entry.value, entry.place, entry.key);
    if (!value) return std::size_t(least);
    if (*value < least || *value > most) {
      yaml_.fault(entry.place, "'" + entry.key + "' must be " + std::to_string(least) + " to " + std::to_string(most) + ", got " + std::to_string(*value));
      return std::size_t(least);
    }
    return std::size_t(*value);
  }

  /// A name that can be part of a cell's name and of a file's.
  void check_name(const std::string& name, const Place& place, const std::string& what) {
    if (name.empty() || name[0] == '.' || name.find_first_of("/\\ \t") != std::string::npos)
      yaml_.fault(place, what + " becomes a file name: '" + name + "' cannot be one", "use letters, digits, '-' and '_'");
  }

  std::vector<InputValue> scalars(const YamlEntry& section) {
    std::vector<InputValue> result;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, section.key)) {
      if (entry.value.IsScalar()) result.push_back({entry.key, entry.value.Scalar(), entry.place});
      else yaml_.fault(entry.place, "'" + entry.key + "' must be one value");
    }
    return result;
  }

  std::vector<std::pair<std::string, Place>> texts(const YamlEntry& entry) {
    std::vector<std::pair<std::string, Place>> result;
    if (!entry.value.IsSequence()) {
      yaml_.fault(entry.place, "'" + entry.key + "' must be a list", "write it as  " + entry.key + ": [a, b]");
      return result;
    }
    for (const YAML::Node& item : entry.value)
      if (const auto text = yaml_.text(item, yaml_.place(item), "an item of '" + entry.key + "'")) result.emplace_back(*text, yaml_.place(item));
    return result;
  }

  static std::string yaml_of(const YAML::Node& value) {
    YAML::Emitter out;
    out << YAML::Flow << value;
    return out.c_str();
  }

  std::vector<Override> overrides(const YamlEntry& section, const std::string& what) {
    std::vector<Override> result;
    if (section.value.IsNull()) return result;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, what))
      result.push_back({entry.key, yaml_of(entry.value), entry.place});
    // What a node uses goes first: it drops the options that were written for another one.
    std::stable_partition(result.begin(), result.end(), [](const Override& one) { return one.key.ends_with(".uses"); });
    return result;
  }

  void read_matrix(const YamlEntry& section) {
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "matrix")) {
      if (!entry.value.IsSequence() || entry.value.size() == 0) {
        yaml_.fault(entry.place, "'" + entry.key + "' in the matrix must be a list of values", "write it as  " + entry.key + ": [a, b]");
        continue;
      }
      std::vector<Override> column;
      for (const YAML::Node& value : entry.value) column.push_back({entry.key, yaml_of(value), yaml_.place(value)});
      matrix_.push_back(std::move(column));
    }
  }

  /// Every variant in every combination of the matrix.
  void apply_matrix() {
    if (matrix_.empty()) return;
    std::vector<Variant> combined = experiment_.variants;
    if (combined.empty()) combined.push_back({"", matrix_[0][0].place, {}});
    for (const std::vector<Override>& column : matrix_) {
      std::vector<Variant> next;
      for (const Variant& variant : combined)
        for (const Override& one : column) {
          Variant more = variant;
          more.name += (more.name.empty() ? "" : "+") + short_value(one.value);
          more.overrides.push_back(one);
          std::stable_partition(more.overrides.begin(), more.overrides.end(), [](const Override& o) { return o.key.ends_with(".uses"); });
          next.push_back(std::move(more));
        }
      combined = std::move(next);
    }
    std::set<std::string> seen;
    for (Variant& variant : combined)
      while (!seen.insert(variant.name).second) variant.name += "_";
    experiment_.variants = std::move(combined);
  }

  /// The part of a value that names it best: of a node, what follows its kind.
  static std::string short_value(std::string value) {
    const std::size_t dot = value.find('.');
    if (dot != std::string::npos && dot + 1 < value.size() && std::isalpha(static_cast<unsigned char>(value[dot + 1]))) value = value.substr(dot + 1);
    for (char& c : value)
      if (std::string("/\\ \t").find(c) != std::string::npos) c = '_';
    return value;
  }

  void read_cases(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"input", "folders", "simulate"};
    experiment_.case_input = "case";
    experiment_.cases_place = section.place;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "cases", &kKeys)) {
      if (entry.key == "input") experiment_.case_input = yaml_.text(entry.value, entry.place, "input").value_or("");
      if (entry.key == "folders")
        for (const auto& [pattern, place] : texts(entry)) add_folders(pattern, place);
      if (entry.key == "simulate") read_simulation(entry);
    }
    if (experiment_.cases.empty() && diagnostics_.empty())
      yaml_.fault(section.place, "there are no cases", "name folders, as  folders: [data/*]  or a simulation");
  }

  void add_folders(const std::string& pattern, const Place& place) {
    glob_t found{};
    const int status = glob((folder_ / pattern).lexically_normal().c_str(), 0, nullptr, &found);
    for (std::size_t i = 0; status == 0 && i < found.gl_pathc; ++i) {
      fs::path folder = found.gl_pathv[i];
      if (folder.filename() == "case.yaml") folder = folder.parent_path();
      if (folder.filename().empty()) folder = folder.parent_path();
      experiment_.cases.push_back({folder.filename().string(), folder, 1, {}});
    }
    globfree(&found);
    if (status != 0) yaml_.fault(place, "there is nothing at '" + pattern + "'", "the path starts at the experiment's file");
  }

  void read_simulation(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"pipeline", "output", "set", "seeds", "inputs", "draw", "seed_input"};
    std::vector<std::int64_t> seeds;
    bool has_seeds = false;
    std::vector<InputValue> inputs;
    std::vector<Range> ranges;
    std::vector<std::pair<std::string, Place>> seed_inputs;
    experiment_.simulation_output = "case";
    simulation_place_ = section.place;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "simulate", &kKeys)) {
      if (entry.key == "pipeline") experiment_.simulation = (folder_ / yaml_.text(entry.value, entry.place, "pipeline").value_or("")).lexically_normal();
      if (entry.key == "output") experiment_.simulation_output = yaml_.text(entry.value, entry.place, "output").value_or("");
      if (entry.key == "set") experiment_.simulation_changes = overrides(entry, "'set'");
      if (entry.key == "seeds") {
        has_seeds = true;
        seeds = read_seeds(entry);
      }
      if (entry.key == "inputs") inputs = scalars(entry);
      if (entry.key == "draw")
        for (const YamlEntry& range : yaml_.map(entry.value, entry.place, "draw")) ranges.push_back({range.key, read_range(range), range.place});
      if (entry.key == "seed_input") seed_inputs = texts(entry);
    }
    if (experiment_.simulation.empty()) yaml_.fault(section.place, "'simulate' does not name its pipeline", "add  pipeline: ../simulate.yaml");
    if (!has_seeds) yaml_.fault(section.place, "'simulate' does not say which seeds", "add  seeds: 1..20  or a list");
    for (std::int64_t seed : seeds) add_simulated(std::uint64_t(seed), inputs, ranges, seed_inputs);
  }

  struct Range {
    std::string input;
    std::array<double, 2> ends;
    Place place;
  };

  void add_simulated(std::uint64_t seed, const std::vector<InputValue>& inputs, const std::vector<Range>& ranges,
                     const std::vector<std::pair<std::string, Place>>& seed_inputs) {
    ExperimentCase one{"seed-" + std::to_string(seed), {}, seed, inputs};
    Random random(seed);
    for (const Range& range : ranges)
      one.inputs.push_back({range.input, number_text(range.ends[0] + (range.ends[1] - range.ends[0]) * random.uniform()), range.place});
    for (const auto& [name, place] : seed_inputs) one.inputs.push_back({name, std::to_string(seed), place});
    experiment_.cases.push_back(std::move(one));
  }

  /// "1..20" or a list of integers.
  std::vector<std::int64_t> read_seeds(const YamlEntry& entry) {
    std::vector<std::int64_t> seeds;
    if (entry.value.IsScalar()) {
      long long first = 0, last = 0;
      int used = 0;
      const std::string text = entry.value.Scalar();
      if (std::sscanf(text.c_str(), "%lld..%lld%n", &first, &last, &used) == 2 && used == int(text.size()) && first >= 0 && first <= last && last - first < 100000) {
        for (long long seed = first; seed <= last; ++seed) seeds.push_back(seed);
        return seeds;
      }
    } else if (entry.value.IsSequence()) {
      for (const YAML::Node& item : entry.value)
        if (const auto seed = yaml_.integer(item, yaml_.place(item), "a seed")) seeds.push_back(*seed);
      return seeds;
    }
    yaml_.fault(entry.place, "'seeds' must be a range such as 1..20 or a list of integers");
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

  void read_starts(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"node", "count", "seed", "rotation_deg", "translation_mm"};
    StartProtocol protocol;
    protocol.place = section.place;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "starts", &kKeys)) {
      if (entry.key == "node") protocol.node = yaml_.text(entry.value, entry.place, "node").value_or("");
      if (entry.key == "count") protocol.count = count(entry, 1, 100000);
      if (entry.key == "seed") protocol.seed = count(entry, 0, std::int64_t(1) << 62);
      if (entry.key == "rotation_deg") protocol.rotation_deg = limit(entry, 180);
      if (entry.key == "translation_mm") protocol.translation_mm = limit(entry, 1000);
    }
    if (protocol.node.empty()) yaml_.fault(section.place, "'starts' does not say which node is displaced", "add  node: start");
    if (protocol.count == 0) yaml_.fault(section.place, "'starts' does not say how many", "add  count: 20");
    experiment_.protocol = protocol;
  }

  double limit(const YamlEntry& entry, double most) {
    const double value = yaml_.number(entry.value, entry.place, entry.key).value_or(0);
    if (value < 0 || value > most) yaml_.fault(entry.place, "'" + entry.key + "' must be 0 to " + number_text(most) + ", got " + number_text(value));
    return value;
  }

  void draw_starts() {
    if (!experiment_.protocol) {
      experiment_.starts.push_back({"0", {}, {}});
      return;
    }
    const StartProtocol& protocol = *experiment_.protocol;
    Random random(protocol.seed);
    const auto vector = [&](double most) {
      const double z = 2 * random.uniform() - 1, angle = 2 * std::numbers::pi * random.uniform(), length = most * random.uniform();
      const double r = std::sqrt(std::max(0.0, 1 - z * z));
      return std::array<double, 3>{length * r * std::cos(angle), length * r * std::sin(angle), length * z};
    };
    for (std::size_t i = 0; i < protocol.count; ++i) {
      Start start{std::to_string(i), vector(protocol.rotation_deg), {}};
      start.translation_mm = vector(protocol.translation_mm);
      experiment_.starts.push_back(std::move(start));
    }
  }

  void read_metrics(const YamlEntry& entry) {
    if (!entry.value.IsSequence()) {
      yaml_.fault(entry.place, "'metrics' must be a list", "write it as  metrics: [errors.distal.final.mtre_mm]");
      return;
    }
    for (const YAML::Node& item : entry.value) {
      const MetricChoice metric = read_metric(item);
      if (metric.path.empty()) continue;
      experiment_.metrics.push_back(metric);
      metric_places_.push_back(yaml_.place(item));
    }
    if (experiment_.metrics.empty() && diagnostics_.empty()) yaml_.fault(entry.place, "'metrics' names no figure", "write it as  metrics: [errors.distal.final.mtre_mm]");
  }

  /// A path, or a path with a name for people.
  MetricChoice read_metric(const YAML::Node& item) {
    static const std::vector<std::string> kKeys{"figure", "label"};
    const Place place = yaml_.place(item);
    MetricChoice metric;
    if (item.IsMap()) {
      for (const YamlEntry& part : yaml_.map(item, place, "a metric", &kKeys))
        (part.key == "figure" ? metric.path : metric.label) = yaml_.text(part.value, part.place, part.key).value_or("");
      if (metric.path.empty() && diagnostics_.empty())
        yaml_.fault(place, "a metric does not say which figure", "write it as  {figure: errors.distal.final.mtre_mm, label: mTRE}");
    } else {
      metric.path = yaml_.text(item, place, "an item of 'metrics'").value_or("");
    }
    if (metric.label.empty()) metric.label = metric.path;
    return metric;
  }

  void set_success(const std::string& path, double value, const Place& place) {
    std::vector<std::string> paths;
    for (MetricChoice& metric : experiment_.metrics) {
      paths.push_back(metric.path);
      if (metric.path != path) continue;
      metric.success_below = value;
      return;
    }
    yaml_.fault(place, "'" + path + "' is not among the metrics", suggestion(path, paths));
  }

  void set_baseline() {
    if (baseline_.empty()) return;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < experiment_.variants.size(); ++i) {
      names.push_back(experiment_.variants[i].name);
      if (names.back() == baseline_) experiment_.baseline = i;
    }
    if (std::find(names.begin(), names.end(), baseline_) == names.end())
      yaml_.fault(baseline_place_, "there is no variant '" + baseline_ + "'", suggestion(baseline_, names));
  }

  /// The pipelines, with the inputs that cells give them and each variant's changes.
  void check_pipelines() {
    if (!experiment_.simulation.empty()) {
      const std::size_t first = std::size_t(std::find_if(experiment_.cases.begin(), experiment_.cases.end(), [](const ExperimentCase& one) { return one.folder.empty(); }) -
                                            experiment_.cases.begin());
      check_output(read_pipeline(experiment_.simulation, simulation_arguments_of(experiment_, first), catalogue_, diagnostics_, true), experiment_.simulation_output,
                   simulation_place_);
    }
    for (std::size_t v = 0; v < experiment_.variants.size(); ++v) {
      Diagnostics faults;
      const Pipeline pipeline = read_pipeline(experiment_.pipeline, arguments_of(experiment_, {v, 0, 0}, "case"), catalogue_, faults, true);
      diagnostics_.add_all(faults);  // what is wrong in every variant is said once
      if (v == 0 && faults.empty()) check_wanted(pipeline);
    }
  }

  void check_wanted(const Pipeline& pipeline) {
    for (std::size_t i = 0; i < experiment_.metrics.size(); ++i) check_metric(pipeline, experiment_.metrics[i].path, metric_places_[i]);
    if (!experiment_.initial_error.empty()) check_metric(pipeline, experiment_.initial_error, initial_place_);
    for (std::size_t i = 0; i < experiment_.pictures.size(); ++i) check_output(pipeline, experiment_.pictures[i], picture_places_[i]);
  }

  void check_metric(const Pipeline& pipeline, const std::string& path, const Place& place) {
    const std::string output = path.substr(0, path.find('.'));
    const PipelineOutput* found = check_output(pipeline, output, place);
    if (!found) return;
    const PortInfo& port = pipeline.nodes[std::size_t(found->source.node)].info.outputs[std::size_t(found->source.output)];
    if (port.type.id != "metrics")
      yaml_.fault(place, "output '" + output + "' is " + port.type.id + ", not figures of merit", "name an output of an evaluate node");
    else if (path.find('.') == std::string::npos)
      yaml_.fault(place, "'" + path + "' does not say which figure", "write it as  " + path + ".mtre_mm, with the items of its lists between");
  }

  const PipelineOutput* check_output(const Pipeline& pipeline, const std::string& name, const Place& place) {
    std::vector<std::string> names;
    for (const PipelineOutput& output : pipeline.outputs) {
      names.push_back(output.name);
      if (output.name == name) return &output;
    }
    if (!names.empty()) yaml_.fault(place, "the pipeline " + pipeline.name + " has no output '" + name + "'", suggestion(name, names));
    return nullptr;
  }

  const Catalogue& catalogue_;
  Diagnostics& diagnostics_;
  StrictYaml yaml_;
  Experiment experiment_;
  fs::path folder_;
  std::vector<std::vector<Override>> matrix_;
  std::vector<std::tuple<std::string, double, Place>> success_;
  std::string baseline_;
  Place baseline_place_, simulation_place_, initial_place_;
  std::vector<Place> metric_places_, picture_places_;
};

}  // namespace

std::vector<CellIndex> cells_of(const Experiment& experiment) {
  std::vector<CellIndex> cells;
  for (std::size_t c = 0; c < experiment.cases.size(); ++c)
    for (std::size_t s = 0; s < experiment.starts.size(); ++s)
      for (std::size_t v = 0; v < experiment.variants.size(); ++v) cells.push_back({v, c, s});
  return cells;
}

std::string cell_id(const Experiment& experiment, const CellIndex& cell) {
  return experiment.variants[cell.variant].name + "/" + experiment.cases[cell.case_index].name + "/" + experiment.starts[cell.start].name;
}

std::optional<CellIndex> cell_of(const Experiment& experiment, const std::string& id) {
  for (std::size_t v = 0; v < experiment.variants.size(); ++v)
    for (std::size_t c = 0; c < experiment.cases.size(); ++c)
      for (std::size_t s = 0; s < experiment.starts.size(); ++s)
        if (cell_id(experiment, {v, c, s}) == id) return CellIndex{v, c, s};
  return std::nullopt;
}

PipelineArguments arguments_of(const Experiment& experiment, const CellIndex& cell, const fs::path& case_folder) {
  PipelineArguments arguments;
  arguments.inputs = experiment.inputs;
  arguments.inputs.push_back({experiment.case_input, fs::absolute(case_folder).string(), experiment.cases_place});
  arguments.overrides = experiment.common;
  const std::vector<Override>& own = experiment.variants[cell.variant].overrides;
  arguments.overrides.insert(arguments.overrides.end(), own.begin(), own.end());
  if (!experiment.protocol) return arguments;
  const Start& start = experiment.starts[cell.start];
  const auto list = [](const std::array<double, 3>& v) { return "[" + number_text(v[0]) + ", " + number_text(v[1]) + ", " + number_text(v[2]) + "]"; };
  arguments.overrides.push_back({experiment.protocol->node + ".rotation_deg", list(start.rotation_deg), experiment.protocol->place});
  arguments.overrides.push_back({experiment.protocol->node + ".translation_mm", list(start.translation_mm), experiment.protocol->place});
  return arguments;
}

PipelineArguments simulation_arguments_of(const Experiment& experiment, std::size_t case_index) {
  PipelineArguments arguments;
  arguments.inputs = experiment.cases[case_index].inputs;
  arguments.overrides = experiment.simulation_changes;
  return arguments;
}

Experiment read_experiment(const fs::path& file, const Catalogue& catalogue, Diagnostics& diagnostics) {
  return Reader(file, catalogue, diagnostics).read();
}

}  // namespace marrow::compare
