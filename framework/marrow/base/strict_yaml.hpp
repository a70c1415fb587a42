// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/diagnostics.hpp"

namespace MARROW_EXPORT marrow {

/// One entry of a map, with the place of its key.
struct YamlEntry {
  std::string key;
  Place place;
  YAML::Node value;
};

/// Reads YAML files that people write. Each fault (base/yaml.hpp) becomes a diagnostic at its place.
class StrictYaml {
 public:
  StrictYaml(std::string file, Diagnostics& diagnostics) : file_(std::move(file)), diagnostics_(diagnostics) {}
  /// For a text that was taken out of a file. All faults are reported at one place.
  StrictYaml(const Place& only, Diagnostics& diagnostics) : file_(only.file), diagnostics_(diagnostics), only_(only) {}

  /// Parses a text, however its writer stored it (plain_text()). A syntax error becomes a diagnostic and gives a null
  /// node.
  YAML::Node parse(const std::string& text);
  /// The same for the text of another file. Its nodes and those of the first file may then be in one tree: each has its
  /// place in its own file.
  YAML::Node parse_also(const std::string& file, const std::string& text);
  Place place(const YAML::Node& node) const { return place_of(node.Mark()); }
  /// The entries of a map in their order. `what` names the map in messages. If `known` is given, other keys are faults.
  std::vector<YamlEntry> map(const YAML::Node& node, const Place& where, const std::string& what,
                             const std::vector<std::string>* known = nullptr);
  std::optional<std::string> text(const YAML::Node& node, const Place& where, const std::string& what);
  std::optional<bool> boolean(const YAML::Node& node, const Place& where, const std::string& what);
  std::optional<std::int64_t> integer(const YAML::Node& node, const Place& where, const std::string& what);
  std::optional<double> number(const YAML::Node& node, const Place& where, const std::string& what);

  void fault(const Place& place, const std::string& message, const std::string& hint = {}) {
    diagnostics_.add(place, message, hint);
  }

 private:
  Place place_of(const YAML::Mark& mark) const;

  YAML::Node parsed(const std::string& text, int first_line);

  struct FurtherFile {
    std::string name;
    int first_line;  ///< as yaml-cpp counts: the files' texts are read as if they followed each other
  };

  std::string file_;
  Diagnostics& diagnostics_;
  std::optional<Place> only_;
  std::vector<FurtherFile> further_;
  int lines_ = 0;  ///< of all texts so far
};

/// The text of a file that people write; "-" is the standard input. It is remembered so that its lines can be shown. If
/// the file cannot be read or is longer than 4 MB, reports a fault and returns nothing. `what` names the file in the
/// fault ("the pipeline file").
std::optional<std::string> read_source(const std::filesystem::path& file, const std::string& what,
                                       Diagnostics& diagnostics);

struct Unclosed {
  char mark;  ///< { [ " or '
  int line;   ///< 1-based
  int column;
};

/// The innermost bracket or quote of a YAML text that is opened but not closed, or that is closed by another kind of
/// bracket.
std::optional<Unclosed> last_unclosed(const std::string& text);

}  // namespace marrow
