// SPDX-License-Identifier: Apache-2.0
#include "marrow/read/case_fragments.hpp"

#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/label_file.hpp"

namespace marrow::read {

namespace fs = std::filesystem;
using files::YamlMap;

std::optional<fs::path> file_in(const fs::path& folder, const YamlMap& map, const std::string& key) {
  const auto text = map.text(key);
  if (!text) return std::nullopt;
  const fs::path inside = fs::path(*text).lexically_normal();
  if (inside.is_absolute() || *inside.begin() == "..") {
    map.fault(key, key + ": '" + *text + "' lies outside the case's folder; copy it into the folder");
    return std::nullopt;
  }
  std::error_code failure;
  const fs::path file = fs::canonical(folder / inside, failure);
  if (failure) {
    map.fault(key, key + ": there is no '" + *text + "' in the case's folder");
    return std::nullopt;
  }
  const fs::path from_folder = file.lexically_relative(fs::canonical(folder));
  if (from_folder.empty() || *from_folder.begin() == "..") {
    map.fault(key, key + ": '" + *text + "' is a link to a place outside the case's folder; copy it into the folder");
    return std::nullopt;
  }
  // A link to a folder could later point to other files although no file of the case has changed.
  for (fs::path part = inside; !part.empty(); part = part.parent_path())
    if (fs::is_symlink(folder / part, failure) && fs::is_directory(folder / part, failure)) {
      map.fault(key, key + ": '" + part.string() + "' is a link to a folder; move the folder itself there");
      return std::nullopt;
    }
  return folder / inside;
}

namespace {

constexpr const char* kWays[] = {"seeds", "label", "surface"};

std::optional<RigidTransform> read_transform(const YamlMap& fragment, const std::string& key) {
  const YamlMap map(fragment.file(), fragment.node(key), key, files::transform_keys());
  return files::transform_from(map, Pose{}.world_from_model);
}

/// The way in which a fragment is given; "" after a fault.
std::string way_of(const YamlMap& fragment) {
  std::vector<std::string> given;
  for (const char* way : kWays)
    if (fragment.has(way)) given.emplace_back(way);
  if (given.size() == 1) return given[0];
  const std::string what = fragment.what() + ": give one of seeds (points inside), label (with `labels` of the case) " +
                           "and surface (a file)";
  fragment.fault(given.empty() ? "" : given[1], given.empty() ? what : what + ", not " + given[0] + " and " + given[1]);
  return "";
}

void read_surface(const fs::path& folder, const YamlMap& fragment, const std::string& name, CaseFiles& result,
                  Context& context) {
  double scale = 1;
  std::optional<fs::path> file;
  if (fragment.node("surface").IsMap()) {
    const YamlMap surface(fragment.file(), fragment.node("surface"), "surface", {"file", "scale"});
    file = file_in(folder, surface, "file");
    if (surface.has("scale")) scale = surface.number("scale").value_or(1);
    if (!(scale >= 1e-6)) return surface.fault("scale", "scale: expected a factor of at least 1e-6, such as 10 for cm");
  } else {
    file = file_in(folder, fragment, "surface");
  }
  if (!file) return;
  if (auto mesh =
          read_or_fault(fragment, "surface", [&] { return exchange::read_surface_file(*file, scale, context); }))
    result.surface.add(name, std::move(*mesh));
}

/// The label map of the case, which is read once.
class Labels {
 public:
  Labels(const fs::path& folder, const YamlMap& map) {
    if (!map.has("labels")) return;
    is_given_ = true;
    if (const auto file = file_in(folder, map, "labels"))
      map_ = read_or_fault(map, "labels", [&] { return files::read_label_file(*file); });
  }
  bool are_given() const { return is_given_; }

  void read(const YamlMap& fragment, const std::string& name, bool is_wanted, CaseFiles& result, Context& context) {
    if (!is_given_)
      return fragment.fault("label", "label: the case names no file of labels; add `labels: FILE` beside `ct`");
    const auto label = fragment.text("label");
    if (!label || !map_) return;
    auto mask = read_or_fault(fragment, "label", [&] {
      const auto warn = [&](const std::string& line) { context.warn(line); };
      return files::mask_of(*map_, files::segment_named(*map_, *label, warn));
    });
    if (mask && is_wanted) result.label.add(name, std::move(*mask));
  }

 private:
  bool is_given_ = false;
  std::optional<files::LabelMap> map_;
};

/// Start and truth. Lists on one axis must have the same items, so only fragments to register get them.
void read_placements(const YamlMap& fragment, const std::string& name, CaseFiles& result) {
  const bool is_wanted = fragment.boolean_or("register", true);
  if (fragment.has("start"))
    if (const auto start = read_transform(fragment, "start"); start && is_wanted) {
      Pose pose;
      pose.world_from_model = *start;
      result.start.add(name, pose);
    }
  if (fragment.has("truth"))
    if (const auto truth = read_transform(fragment, "truth"); truth && is_wanted) result.truth.add(name, {*truth});
}

void check_together(const YamlMap& map, const std::vector<std::string>& ways, bool has_labels) {
  for (const std::string& way : ways)
    if (way != ways[0])
      return map.fault("fragments", "fragments: some are given by " + ways[0] + ", some by " + way +
                                        "; give all of them in the same way");
  if (has_labels && !ways.empty() && ways[0] != "label")
    map.fault("labels", "labels: no fragment has a label of this file; give it as `NAME: {label: NUMBER_OR_NAME}`");
}

}  // namespace

void read_fragments(const fs::path& folder, const YamlMap& map, CaseFiles& result, Context& context) {
  Labels labels(folder, map);
  result.has_seeds = !map.has("fragments");
  const auto fragments = map.required("fragments");
  if (!fragments) return;
  if (!fragments->IsMap() || fragments->size() == 0)
    return map.fault("fragments",
                     "fragments: expected at least one fragment by name, with its seeds, its label or its surface");
  std::vector<std::string> ways, with_start, with_truth;
  const YamlMap by_name(map.file(), *fragments, "fragments", files::FreeKeys{});
  for (const std::string& name : by_name.keys()) {
    const YamlMap fragment(map.file(), by_name.node(name), "fragment '" + name + "'",
                           {"seeds", "label", "surface", "register", "start", "truth"});
    if (!fragment.valid()) continue;
    const bool is_wanted = fragment.boolean_or("register", true);
    const std::string way = way_of(fragment);
    if (!way.empty()) ways.push_back(way);
    if (way == "seeds") result.seeds.add(name, files::seeds_from(fragment, name));
    if (way == "label") labels.read(fragment, name, is_wanted, result, context);
    if (way == "surface" && is_wanted) read_surface(folder, fragment, name, result, context);
    result.has_seeds |= way.empty() || way == "seeds";
    read_placements(fragment, name, result);
    if (!is_wanted) continue;
    result.registered.push_back(name);
    if (fragment.has("start")) with_start.push_back(name);
    if (fragment.has("truth")) with_truth.push_back(name);
  }
  check_together(map, ways, labels.are_given());
  if (result.registered.empty())
    map.fault("fragments", "fragments: every fragment has register: false; register at least one");
  if (!with_start.empty() && with_start != result.registered)
    map.fault("fragments",
              "fragments: some of the fragments to register have a start; give it for all of them or for none");
  if (!with_truth.empty() && with_truth != result.registered)
    map.fault("fragments",
              "fragments: some of the fragments to register have a truth; give it for all of them or for none");
}

}  // namespace marrow::read
