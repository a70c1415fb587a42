// SPDX-License-Identifier: Apache-2.0
#include "experiment_sections.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "draw.hpp"
#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

class Reader {
 public:
  Reader(const fs::path& file, Diagnostics& diagnostics, std::size_t more_cases)
      : diagnostics_(diagnostics), yaml_(file.string(), diagnostics) {
    experiment_.file = file;
    experiment_.more_cases = more_cases;
  }

  WrittenExperiment read() {
    LayeredExperiment layered = read_layers(yaml_, experiment_.file, diagnostics_);
    experiment_.text = std::move(layered.text);
    experiment_.files = std::move(layered.files);
    if (diagnostics_.empty()) read_root(layered.root);
    return written_;
  }

 private:
  void read_root(const YAML::Node& root) {
    static const std::vector<std::string> kKeys{
        "extends",  "experiment", "name",        "help",   "pipeline", "inputs",  "set",
        "cases",    "variants",   "matrix",      "starts", "metrics",  "success", "initial_error",
        "baseline", "pictures",   "timed_cells", "stop",   "sweep",    "tune",    "compare_all"};
    const Place start{experiment_.file.string(), 1, 1};
    const std::vector<YamlEntry> entries = yaml_.map(root, start, "the experiment", &kKeys);
    if (!root.IsMap()) return;
    for (const YamlEntry& entry : entries) read_entry(entry);
    if (experiment_.name.empty() && name_of_file_is_good(start)) experiment_.name = experiment_.file.stem().string();
    const auto need = [&](const std::string& key, const std::string& hint) {
      if (std::none_of(entries.begin(), entries.end(), [&](const YamlEntry& e) { return e.key == key; }))
        yaml_.fault(start, "the key '" + key + "' is missing", hint);
    };
    need("experiment", "begin the file with  experiment: 1");
    need("pipeline", "name the pipeline file whose variants are compared");
    need("cases",
         "say on which data, as  cases: {folders: [...]},  {simulate: ...}  or, where the pipeline makes its data "
         "itself,  {seeds: 1..20}");
    need("metrics", "name the figures to compare, as  metrics: [errors.distal.final.mtre_mm]");
    if (experiment_.cases.empty() && diagnostics_.empty())
      yaml_.fault(experiment_.cases_place, "there are no cases",
                  "name folders, as  folders: [data/*]  or a simulation");
    std::vector<Override> columns;
    for (const std::vector<Override>& column : matrix_) columns.push_back(column.front());
    refuse_replaced_values(yaml_, experiment_, {options_set_by("'matrix'", columns), {"'sweep'", sweep_.names()}},
                           {"'tune'", tune_.names()});
    apply_matrix();
    sweep_.apply(experiment_);
    tune_.add_variant(experiment_);
    if (experiment_.variants.empty() && diagnostics_.empty())
      yaml_.fault(start, "there are no variants",
                  "name at least one under  variants:  or options under  matrix:,  sweep:  or  tune:");
    for (const auto& [path, value, place] : success_) set_success(path, value, place);
    if (!baseline_.name.empty()) find_variant(yaml_, experiment_, baseline_, experiment_.baseline);
    if (is_too_large(start)) return;
    const std::size_t starts = experiment_.protocol ? experiment_.protocol->count : 1;
    stop_.apply(experiment_, starts);
    tune_.apply(experiment_, starts);
    check_compare_all(yaml_, experiment_);
    if (experiment_.protocol)
      experiment_.starts = draw_starts(*experiment_.protocol);
    else
      experiment_.starts.push_back({"0", {}, {}});
  }

  bool name_of_file_is_good(const Place& start) {
    const std::string name = experiment_.file.stem().string(), fault = fault_of_name(name);
    if (!fault.empty())
      yaml_.fault(start,
                  "the experiment is named after its file, which becomes a folder's name: " + in_quotes(name) +
                      " cannot be one, " + fault,
                  "give it another, as  name: edges");
    return fault.empty();
  }

  bool is_too_large(const Place& start) {
    const std::size_t variants = experiment_.variants.size(), cases = experiment_.cases.size(),
                      starts = experiment_.protocol ? experiment_.protocol->count : 1;
    if (variants > kMostVariants) {
      yaml_.fault(variants_place_,
                  formatted("there are {} variants, at most {} can be compared", variants, kMostVariants),
                  "make several experiments of them");
      return true;
    }
    if (double(variants) * double(cases) * double(starts) <= double(kMostCells)) return false;
    const std::string cells = formatted("{:.0f}", double(variants) * double(cases) * double(starts));
    yaml_.fault(start,
                formatted("{} variants, {} cases and {} starts are {} cells, at most {} can be compared", variants,
                          cases, starts, cells, kMostCells),
                "take fewer of them, or make several experiments");
    return true;
  }

  void read_entry(const YamlEntry& entry) {
    const auto text = [&] { return yaml_.text(entry.value, entry.place, entry.key).value_or(""); };
    if (entry.key == "experiment") {
      const auto version = yaml_.integer(entry.value, entry.place, "experiment");
      if (version && *version != 1)
        yaml_.fault(entry.place, formatted("this file is of format {}, this program reads format 1", *version));
    }
    if (entry.key == "name") {
      experiment_.name = text();
      if (!entry.value.IsScalar() || !check_name(yaml_, experiment_.name, entry.place, "an experiment's name"))
        experiment_.name = "?";
    }
    if (entry.key == "help") experiment_.help = text();
    if (entry.key == "pipeline") experiment_.pipeline = file_of(yaml_, entry);
    if (entry.key == "inputs") experiment_.inputs = inputs_of(yaml_, entry);
    if (entry.key == "set") experiment_.common = patches_of(yaml_, entry, "'set'");
    if (entry.key == "cases") read_cases(yaml_, entry, written_);
    if (entry.key == "variants") read_variants(entry);
    if (entry.key == "matrix") read_matrix(entry);
    if (entry.key == "starts") read_starts(entry);
    if (entry.key == "metrics") read_metrics(entry);
    if (entry.key == "success")
      for (const YamlEntry& limit : yaml_.map(entry.value, entry.place, "'success'"))
        if (const auto value = yaml_.number(limit.value, limit.place, limit.key))
          success_.emplace_back(limit.key, *value, limit.place);
    if (entry.key == "initial_error") {
      experiment_.initial_error = text();
      experiment_.initial_error_place = entry.place;
    }
    if (entry.key == "baseline") baseline_ = {text(), entry.place};
    if (entry.key == "pictures")
      for (const auto& [name, place] : texts_of(yaml_, entry)) {
        experiment_.pictures.push_back(name);
        written_.picture_places.push_back(place);
      }
    if (entry.key == "stop") stop_.read(entry);
    if (entry.key == "sweep") sweep_.read(entry);
    if (entry.key == "tune") tune_.read(entry);
    if (entry.key == "timed_cells") experiment_.timed_cells = count_of(yaml_, entry, 0, 1000);
    if (entry.key == "compare_all") read_compare_all(yaml_, entry, experiment_);
  }

  void read_variants(const YamlEntry& section) {
    variants_place_ = section.place;
    std::map<std::string, std::string> seen;  // by their names in small letters
    for (const YamlEntry& variant : yaml_.map(section.value, section.place, "'variants'")) {
      if (!check_name(yaml_, variant.key, variant.place, "a variant's name")) continue;
      const auto [other, is_new] = seen.emplace(in_small_letters(variant.key), variant.key);
      if (!is_new)
        yaml_.fault(
            variant.place,
            "the variants '" + other->second + "' and '" + variant.key + "' are one folder to some file systems",
            "rename one of them");
      experiment_.variants.push_back(
          {variant.key, variant.place, patches_of(yaml_, variant, "variant '" + variant.key + "'")});
    }
  }

  void read_matrix(const YamlEntry& section) {
    matrix_place_ = section.place;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'matrix'")) {
      if (!entry.value.IsSequence() || entry.value.size() == 0) {
        yaml_.fault(entry.place, "'" + entry.key + "' in the matrix must be a list of values",
                    "write it as  " + entry.key + ": [a, b]");
        continue;
      }
      std::vector<Override> column;
      for (const YAML::Node& value : entry.value) {
        const Place place = yaml_.place(value);
        column.push_back({entry.key, changed_value(yaml_, entry.key, value, place), place});
      }
      matrix_.push_back(std::move(column));
    }
  }

  /// Combines every variant with every combination of the matrix.
  void apply_matrix() {
    if (matrix_.empty() || matrix_is_too_large()) return;
    std::vector<Variant> combined = experiment_.variants;
    if (combined.empty()) combined.push_back({"", matrix_[0][0].place, {}});
    for (const std::vector<Override>& column : matrix_) {
      std::vector<Variant> next;
      for (const Variant& variant : combined)
        for (const Override& one : column) {
          Variant more = variant;
          if (!more.name.empty()) more.name += '+';
          more.name += short_value(one.value);
          more.overrides.push_back(one);
          put_uses_first(more.overrides);
          next.push_back(std::move(more));
        }
      combined = std::move(next);
    }
    set_factors(experiment_, matrix_, combined);
    make_names_distinct(combined);
    for (const Variant& variant : combined)
      if (!check_name(yaml_, variant.name, variant.place, "a variant's name"))
        break;  // the others have much the same fault
    experiment_.variants = std::move(combined);
  }

  /// Checks the number of combinations and the length of their names before any combination is made. Both follow from
  /// the columns of the matrix.
  bool matrix_is_too_large() {
    double count = double(std::max<std::size_t>(1, experiment_.variants.size()));
    std::size_t longest = 0;
    for (const Variant& variant : experiment_.variants) longest = std::max(longest, variant.name.size() + 1);
    for (const std::vector<Override>& column : matrix_) {
      count *= double(column.size());
      std::size_t most = 0;
      for (const Override& one : column) most = std::max(most, short_value(one.value).size());
      longest += most + (&column == &matrix_.front() ? 0 : 1);
    }
    if (count > double(kMostVariants)) {
      const std::string variants = count < 1e15 ? formatted("{:.0f}", count) : formatted("{:.0e}", count);
      yaml_.fault(matrix_place_,
                  formatted("the matrix makes {} variants, at most {} can be compared", variants, kMostVariants),
                  "leave values out, or name the combinations that matter under  variants:");
      return true;
    }
    if (longest <= kMostNameBytes) return false;
    yaml_.fault(
        matrix_place_,
        formatted("the matrix makes a variant's name of {} bytes of its values; as a folder's name it may have {}",
                  longest, kMostNameBytes),
        "name the combinations under  variants:");
    return true;
  }

  /// Different values may give the same name. The names then get -2, -3 and so on.
  static void make_names_distinct(std::vector<Variant>& variants) {
    std::set<std::string> taken;
    std::map<std::string, int> last;
    for (const Variant& variant : variants) last[in_small_letters(variant.name)] = 1;
    for (Variant& variant : variants) {
      if (taken.insert(in_small_letters(variant.name)).second) continue;
      const std::string name = variant.name;
      int& number = last[in_small_letters(name)];
      do variant.name = formatted("{}-{}", name, ++number);
      while (last.contains(in_small_letters(variant.name)) || !taken.insert(in_small_letters(variant.name)).second);
    }
  }

  /// A short name for a value. For a node, it is the part after the kind.
  static std::string short_value(std::string value) {
    const std::size_t dot = value.find('.');
    if (dot != std::string::npos && dot < kMostNameBytes && dot + 1 < value.size() &&
        std::isalpha(static_cast<unsigned char>(value[dot + 1])))
      value = value.substr(dot + 1);
    for (char& c : value)
      if (std::string("/\\ \t\n").find(c) != std::string::npos) c = '_';
    return value;
  }

  void read_starts(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"node",         "count",          "seed",
                                                "rotation_deg", "translation_mm", "distance_mm"};
    StartProtocol protocol;
    protocol.place = section.place;
    bool has_node = false, has_count = false;
    for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'starts'", &kKeys)) {
      has_node |= entry.key == "node";
      has_count |= entry.key == "count";
      if (entry.key == "node") protocol.node = yaml_.text(entry.value, entry.place, "node").value_or("");
      if (entry.key == "count") protocol.count = count_of(yaml_, entry, 1, 100000);
      if (entry.key == "seed") protocol.seed = count_of(yaml_, entry, 0, std::int64_t(1) << 62);
      if (entry.key == "rotation_deg") protocol.rotation_deg = limit_of(yaml_, entry, 180);
      if (entry.key == "translation_mm") protocol.translation_mm = limit_of(yaml_, entry, 1000);
      if (entry.key == "distance_mm") protocol.distance_mm = limit_of(yaml_, entry, 1000);
    }
    if (!section.value.IsMap()) return;
    if (!has_node) yaml_.fault(section.place, "'starts' does not say which node is displaced", "add  node: start");
    if (!has_count) yaml_.fault(section.place, "'starts' does not say how many", "add  count: 20");
    experiment_.protocol = protocol;
  }

  void read_metrics(const YamlEntry& entry) {
    const std::string hint = "write it as  metrics: [errors.distal.final.mtre_mm]";
    if (!entry.value.IsSequence()) return yaml_.fault(entry.place, "'metrics' must be a list", hint);
    if (entry.value.size() == 0) return yaml_.fault(entry.place, "'metrics' names no figure", hint);
    if (entry.value.size() > kMostMetrics)
      return yaml_.fault(entry.place, formatted("'metrics' names {} figures, at most {} can be compared",
                                                entry.value.size(), kMostMetrics));
    for (const YAML::Node& item : entry.value) {
      const Place place = yaml_.place(item);
      const MetricChoice metric = read_metric(item, place);
      const auto is_same = [&](const MetricChoice& other) { return other.path == metric.path; };
      if (metric.path.empty()) continue;
      if (std::any_of(experiment_.metrics.begin(), experiment_.metrics.end(), is_same))
        yaml_.fault(place, "'" + metric.path + "' is given twice in 'metrics'");
      experiment_.metrics.push_back(metric);
    }
  }

  /// Reads a metric, which is a path, or a path with a label.
  MetricChoice read_metric(const YAML::Node& item, const Place& place) {
    static const std::vector<std::string> kKeys{"figure", "label", "better"};
    MetricChoice metric;
    metric.place = place;
    if (item.IsMap()) {
      bool has_figure = false;
      for (const YamlEntry& part : yaml_.map(item, place, "a metric", &kKeys)) {
        has_figure |= part.key == "figure";
        const std::string text = yaml_.text(part.value, part.place, part.key).value_or("");
        if (part.key == "better")
          metric.better = read_better(text, part.place);
        else
          (part.key == "figure" ? metric.path : metric.label) = text;
      }
      if (!has_figure)
        yaml_.fault(place, "a metric does not say which figure",
                    "write it as  {figure: errors.distal.final.mtre_mm, label: mTRE}");
    } else {
      metric.path = yaml_.text(item, place, "an item of 'metrics'").value_or("");
    }
    if (const std::string odd = odd_character_in(metric.label); !odd.empty())
      yaml_.fault(place, "the label " + in_quotes(metric.label) + " holds " + odd, "write it without");
    if (metric.label.empty()) metric.label = metric.path;
    return metric;
  }

  MetricChoice::Better read_better(const std::string& text, const Place& place) {
    static const std::vector<std::string> kNames{"lower", "higher", "nearest_zero"};
    const auto found = std::find(kNames.begin(), kNames.end(), text);
    if (found == kNames.end()) yaml_.fault(place, "'" + text + "' is no way to be better", suggestion(text, kNames));
    return found == kNames.end() ? MetricChoice::Better::lower : MetricChoice::Better(found - kNames.begin());
  }

  void set_success(const std::string& path, double value, const Place& place) {
    const auto found = find_metric(yaml_, experiment_, {path, place});
    if (!found) return;
    MetricChoice& metric = experiment_.metrics[*found];
    metric.limit = value;
    if (metric.better == MetricChoice::Better::nearest_zero && value <= 0)
      yaml_.fault(place, formatted("the limit of '{}' is {:.6g}, but its magnitude counts, which is never below 0",
                                   path, value));
  }

  Diagnostics& diagnostics_;
  StrictYaml yaml_;
  WrittenExperiment written_;
  Experiment& experiment_ = written_.experiment;
  StopReader stop_{yaml_};
  SweepReader sweep_{yaml_};
  TuneReader tune_{yaml_};
  std::vector<std::vector<Override>> matrix_;
  std::vector<std::tuple<std::string, double, Place>> success_;
  Named baseline_;
  Place variants_place_, matrix_place_;
};

}  // namespace

WrittenExperiment read_written_experiment(const fs::path& file, Diagnostics& diagnostics, std::size_t more_cases) {
  return Reader(file, diagnostics, more_cases).read();
}

}  // namespace marrow::compare
