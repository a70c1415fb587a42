// SPDX-License-Identifier: Apache-2.0
#pragma once
// Readers of the sections of an experiment file, and what is checked between them.
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/strict_yaml.hpp"
#include "marrow/compare/experiment.hpp"

namespace marrow::compare {

using PlacedTexts = std::vector<std::pair<std::string, Place>>;

/// A name that a file gives, and where.
struct Named {
  std::string name;
  Place place;
};

/// Reads a list of texts.
PlacedTexts texts_of(StrictYaml& yaml, const YamlEntry& entry);
/// Reads values of inputs, written as name: value, or as name: $env:VARIABLE.
std::vector<InputValue> inputs_of(StrictYaml& yaml, const YamlEntry& section);
/// Reads changes of a pipeline, written as node.option: value and so on. `what` names the section in messages.
std::vector<Override> patches_of(StrictYaml& yaml, const YamlEntry& section, const std::string& what);
/// The value of a change, as it is written on the command line. No value is a fault.
std::string changed_value(StrictYaml& yaml, const std::string& key, const YAML::Node& value, const Place& place);
/// Moves changes of `uses` to the front, because such a change drops the options that the file gives to the replaced
/// node.
void put_uses_first(std::vector<Override>& patches);

/// Reads an integer in a range. Reports a fault and returns the least one for any other value.
std::uint64_t count_of(StrictYaml& yaml, const YamlEntry& entry, std::int64_t least, std::int64_t most);
/// Reads a number from 0 to `most`. Reports a fault and returns 0 for any other value.
double limit_of(StrictYaml& yaml, const YamlEntry& entry, double most);

inline constexpr std::size_t kMostNameBytes = 100;
/// Whether a name can be a part of a cell's name and the name of a folder. Reports a fault if not.
bool check_name(StrictYaml& yaml, const std::string& name, const Place& place, const std::string& what);
/// The name in small letters. To some file systems, names that differ only in the case of their letters are the same.
std::string in_small_letters(std::string name);
/// Sets `number` to that of the variant with this name. Reports a fault if there is none.
void find_variant(StrictYaml& yaml, const Experiment& experiment, const Named& asked, std::size_t& number);
/// The number of the metric with this path. Reports a fault if there is none.
std::optional<std::size_t> find_metric(StrictYaml& yaml, const Experiment& experiment, const Named& asked);
std::vector<Named> names_of_options(const std::vector<SweptOption>& options);
/// The file that a key names, relative to the file that the key is in. If there is none, reports a fault and returns an
/// empty path.
std::filesystem::path file_of(StrictYaml& yaml, const YamlEntry& entry);

/// An experiment file with the files that it extends.
struct LayeredExperiment {
  YAML::Node root;                           ///< a map; if the file cannot be read, null
  std::string text;                          ///< of the file itself
  std::vector<std::filesystem::path> files;  ///< all that were read; the file itself comes first
};

/// Reads the files, and puts the entries of each over those of the file that it extends: maps are merged, anything else
/// is replaced, and null removes an entry of the file below. A file's name is its own.
LayeredExperiment read_layers(StrictYaml& yaml, const std::filesystem::path& file, Diagnostics& diagnostics);

/// The folder of the file that a place is in.
std::filesystem::path folder_of(const Place& place);

/// An experiment with everything that is drawn for it. The places in its file are those of names that can only be
/// checked against the pipelines.
struct WrittenExperiment {
  Experiment experiment;
  Place simulation_place;
  std::vector<Place> picture_places;
};

WrittenExperiment read_written_experiment(const std::filesystem::path& file, Diagnostics& diagnostics,
                                          std::size_t more_cases);

/// Reads the section 'cases': folders, seeds, and simulations whose inputs are drawn. `experiment.more_cases` seeds
/// follow those that it names.
void read_cases(StrictYaml& yaml, const YamlEntry& section, WrittenExperiment& written);

/// Reads the section 'stop': when a comparison with more and more cases ends. Names in it can be checked only after the
/// whole file was read.
class StopReader {
 public:
  explicit StopReader(StrictYaml& yaml) : yaml_(yaml) {}
  void read(const YamlEntry& section);
  /// Puts the rule into the experiment if there is one. Its metrics, variants and cases are read before, and `starts`
  /// is the number of its starts.
  void apply(Experiment& experiment, std::size_t starts);

 private:
  void check_keys(const YamlEntry& section);
  void find_figure(const Experiment& experiment, StopRule& rule);
  void find_variant(const Experiment& experiment, StopRule& rule);
  void check_cases(const Experiment& experiment, const StopRule& rule, std::size_t starts);

  StrictYaml& yaml_;
  bool is_given_ = false;
  StopRule rule_;
  Place place_, most_place_;
  std::optional<Named> figure_, difference_, variant_, width_, alpha_;
};

/// Reads an option and its range, as  edges.high: [60, 90]  or  {range: [0.7, 2.8], scale: log}. Reports its faults.
SweptOption swept_option_of(StrictYaml& yaml, const YamlEntry& entry);

/// Reads the section 'sweep': options whose numbers are tried over ranges, on a grid or at Sobol's points. Each point
/// becomes one variant, or one for each variant of the file.
class SweepReader {
 public:
  explicit SweepReader(StrictYaml& yaml) : yaml_(yaml) {}
  void read(const YamlEntry& section);
  std::vector<Named> names() const { return names_of_options(options_); }
  /// Puts the swept options into the experiment, and the points into its variants. Call it when these are complete
  /// otherwise.
  void apply(Experiment& experiment);

 private:
  void check(const YamlEntry& section);
  std::vector<std::vector<double>> points() const;

  StrictYaml& yaml_;
  Place place_;
  bool is_good_ = false;
  std::size_t grid_ = 0, sobol_ = 0;
  std::vector<SweptOption> options_;
};

/// Reads the section 'tune': options whose numbers an optimizer chooses on training cases. Names in it can be checked
/// only after the whole file was read.
class TuneReader {
 public:
  explicit TuneReader(StrictYaml& yaml) : yaml_(yaml) {}
  void read(const YamlEntry& section);
  std::vector<Named> names() const { return names_of_options(rule_.options); }
  /// Adds the pipeline as it is, if the experiment has no variant.
  void add_variant(Experiment& experiment) const;
  /// Puts the rule into the experiment if there is one. Its metrics, variants and cases are read before, and `starts`
  /// is the number of its starts.
  void apply(Experiment& experiment, std::size_t starts);

 private:
  void read_optimizer(const YamlEntry& section);
  void check_keys(const YamlEntry& section);
  void find_figure(const Experiment& experiment, TuneRule& rule);
  void find_failed_as(const MetricChoice& metric, TuneRule& rule);
  void check_names(const Experiment& experiment);
  void check_cases(const Experiment& experiment, const TuneRule& rule, std::size_t starts);

  StrictYaml& yaml_;
  bool is_given_ = false, is_good_ = false, has_optimizer_ = false;
  TuneRule rule_;
  Place place_, cases_place_;
  std::optional<Named> figure_, variant_;
  std::optional<double> failed_as_;
  Place failed_as_place_;
};

/// Names the experiment's factors and gives each variant that the matrix made its levels. `columns` are those of the
/// matrix, each with its values. `combined` has the experiment's own variants, or one without a name, in all
/// combinations: the last column changes fastest.
void set_factors(Experiment& experiment, const std::vector<std::vector<Override>>& columns,
                 std::vector<Variant>& combined);

void read_compare_all(StrictYaml& yaml, const YamlEntry& entry, Experiment& experiment);
/// Reports a fault if all pairs are too many. The variants and figures are known.
void check_compare_all(StrictYaml& yaml, const Experiment& experiment);

/// The options, or the inputs, that a section of an experiment's file sets.
struct SetBySection {
  std::string section;  ///< "variant 'canny'"
  std::vector<Named> names;
};

SetBySection options_set_by(const std::string& section, const std::vector<Override>& changes);
/// Reports each name of `first` that `later` sets too. Its value would have no effect in any cell.
void refuse_replaced(StrictYaml& yaml, const std::string& what, const SetBySection& first, const SetBySection& later);
/// Calls refuse_replaced() for the sections of an experiment, before variants are combined. The sections are applied in
/// this order: 'set', the variants, `combined` ('matrix' and 'sweep'), `tuned`, 'starts'. A variant may change what
/// 'set' says, and only one variant is tuned; so neither is reported here. An input that is given for all cases must
/// not also have a value for each case.
void refuse_replaced_values(StrictYaml& yaml, const Experiment& experiment, std::vector<SetBySection> combined,
                            const SetBySection& tuned);

}  // namespace marrow::compare
