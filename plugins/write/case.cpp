// SPDX-License-Identifier: Apache-2.0
// Writes folders: a view, or a whole case in the format of read.case (docs/case.md).
#include <algorithm>
#include <cctype>
#include <map>
#include <marrow/base/names.hpp>
#include <marrow/base/printable.hpp>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"
#include "marrow/write/picture_out.hpp"

namespace {

namespace fs = std::filesystem;
using marrow::phantom::CaseFolder;
using YAML::BeginMap, YAML::EndMap, YAML::BeginSeq, YAML::EndSeq, YAML::Key, YAML::Value;

/// PNG for images of 8 and 16 bits, TIFF for float images.
std::string image_name(const marrow::Image& image) { return image.pixels.depth() == CV_32F ? ".tif" : ".png"; }

/// Writes <stem>.png, <stem>.camera.yaml and <stem>.mask.png. With an empty stem: image.png, camera.yaml and mask.png.
struct ViewFiles {
  std::string image, camera, mask;
};
ViewFiles write_view_files(const marrow::View& view, const fs::path& folder, const std::string& stem) {
  const std::string dot = stem.empty() ? "" : stem + ".";
  ViewFiles files{(stem.empty() ? "image" : stem) + image_name(view.image), dot + "camera.yaml", ""};
  marrow::write::write_pixels(folder / files.image, view.image.pixels);
  marrow::files::write_plainly(folder / files.camera, {marrow::files::camera(view.camera)});
  if (!view.mask.empty()) {
    files.mask = dot + "mask.png";
    marrow::write::write_pixels(folder / files.mask, view.mask);
  }
  return files;
}

void view(const marrow::View& view, const std::string& path) {
  marrow::files::write_atomically(path, [&](const fs::path& folder) {
    fs::create_directory(folder);
    write_view_files(view, folder, "");
  });
}

bool is_plain(const std::string& name) {
  return !name.empty() && name.size() <= 100 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
}

/// The file names of the views. A view's own name is used if it is plain, otherwise a number that no other view has. On
/// some file systems, names that differ only in capital letters mean the same file.
std::vector<std::string> file_stems(const std::vector<std::string>& names) {
  std::vector<std::string> stems, taken;
  for (const std::string& name : names) taken.push_back(marrow::files::in_small_letters(name));
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::string stem = names[i];
    for (std::size_t number = i + 1;
         !is_plain(names[i]) && (stem == names[i] || std::count(taken.begin(), taken.end(), stem)); ++number)
      stem = marrow::formatted("view-{}", number);
    taken.push_back(stem);
    stems.push_back(stem);
  }
  return stems;
}

/// Writes the files of the views and puts their list.
void put_views(YAML::Emitter& out, const marrow::Case& value, const fs::path& folder) {
  out << Key << "views" << Value << BeginSeq;
  const std::vector<std::string> stems = file_stems(value.views.names());
  for (std::size_t i = 0; i < value.views.size(); ++i) {
    const ViewFiles files = write_view_files(value.views[i], folder, stems[i]);
    out << BeginMap << Key << "name" << Value << YAML::DoubleQuoted << value.views.name(i);
    out << Key << "image" << Value << files.image << Key << "camera" << Value << files.camera;
    if (!files.mask.empty()) out << Key << "mask" << Value << files.mask;
    out << EndMap;
  }
  out << EndSeq;
}

void put_placement(YAML::Emitter& out, const std::string& key, const marrow::RigidTransform& world_from_model) {
  out << Key << key << Value << BeginMap;
  marrow::files::put_transform(out, world_from_model);
  out << EndMap;
}

/// Puts the key that says what a fragment is made from, and `register`.
void put_fragment(YAML::Emitter& out, const CaseFolder& folder, std::size_t index, const std::string& surface_file) {
  const marrow::Seeds& seeds = folder.parts.seeds[index];
  if (folder.labels.values.empty() && surface_file.empty()) return marrow::files::put_seeds(out, seeds);
  if (surface_file.empty())
    out << Key << "label" << Value << index + 1;
  else
    out << Key << "surface" << Value << surface_file;
  out << Key << "register" << Value << seeds.wanted;
}

/// Writes the surfaces, if there are any, and puts the map of fragments.
void put_fragments(YAML::Emitter& out, const CaseFolder& whole, const fs::path& folder) {
  const marrow::Case& value = whole.parts;
  out << Key << "fragments" << Value << BeginMap;
  const std::vector<std::string> stems = file_stems(value.seeds.names());
  for (std::size_t i = 0; i < value.seeds.size(); ++i) {
    const std::string& name = value.seeds.name(i);
    out << Key << YAML::DoubleQuoted << name << Value << BeginMap;
    std::string file;
    if (const marrow::Mesh* surface = whole.surfaces.find(name)) {
      file = stems[i] + ".vtp";
      marrow::files::write_plainly(folder / file, {marrow::exchange::vtp_bytes(*surface)});
    }
    put_fragment(out, whole, i, file);
    if (const marrow::Pose* start = value.start.find(name)) put_placement(out, "start", start->world_from_model);
    if (const marrow::Truth* truth = value.truth.find(name)) put_placement(out, "truth", truth->world_from_model);
    out << EndMap;
  }
  out << EndMap;
}

/// Throws Error if read.case would refuse the written case.
void check_case(const marrow::Case& value, const std::string& path) {
  if (value.views.empty()) throw marrow::Error(path + ": the case has no view");
  if (value.seeds.empty()) throw marrow::Error(path + ": the case has no fragment with seeds");
  const auto check_names = [&](const std::vector<std::string>& names, const std::string& what) {
    for (const std::string& name : names)
      if (const std::string fault = marrow::fault_of_item_name(name); !fault.empty())
        throw marrow::Error(path + ": the name " + marrow::in_quotes(marrow::printable(name)) + " of a " + what + " " +
                            fault + "; choose another");
    for (std::size_t i = 0; i < names.size(); ++i)
      if (std::find(names.begin(), names.begin() + std::ptrdiff_t(i), names[i]) != names.begin() + std::ptrdiff_t(i))
        throw marrow::Error(path + ": two " + what + "s are named '" + names[i] + "'");
  };
  check_names(value.views.names(), "view");
  std::map<std::string, std::string> files;  // the key is in small letters
  for (const std::string& name : value.views.names())
    if (const auto [other, is_new] = files.emplace(marrow::files::in_small_letters(name), name); !is_new)
      throw marrow::Error(path + ": the views '" + other->second + "' and '" + name +
                          "' are the same file on some file systems; rename one of them");
  check_names(value.seeds.names(), "fragment");
  const auto check = [&](const std::vector<std::string>& names, const std::string& what) {
    for (const std::string& name : names)
      if (!value.seeds.find(name))
        throw marrow::Error(path + ": fragment '" + name + "' has a " + what + " but no seeds");
  };
  check(value.start.names(), "start");
  check(value.truth.names(), "truth");
  marrow::check_volume(value.ct, path + ": ct");
}

void write_folder(const CaseFolder& whole, const std::string& path) {
  const marrow::Case& value = whole.parts;
  check_case(value, path);
  const bool has_ct = whole.surfaces.empty(), has_labels = !whole.labels.values.empty();
  marrow::files::write_atomically(path, [&](const fs::path& folder) {
    fs::create_directory(folder);
    YAML::Emitter out;
    out << BeginMap << Key << "marrow-case" << Value << 1;
    if (has_ct) marrow::write::write_grid(folder / "ct.mha", value.ct.grid, value.ct.values);
    if (has_ct) out << Key << "ct" << Value << "ct.mha";
    if (has_labels) marrow::write::write_grid(folder / "labels.mha", whole.labels.grid, whole.labels.values);
    if (has_labels) out << Key << "labels" << Value << "labels.mha";
    put_views(out, value, folder);
    put_fragments(out, whole, folder);
    out << EndMap;
    marrow::files::write_plainly(folder / "case.yaml", {marrow::files::text_of(out)});
  });
}

void write_case(const marrow::Case& value, const std::string& path) { write_folder({value, {}, {}}, path); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<marrow::View>(
      "", view, "folder with image.png (image.tif for float), camera.yaml and, if the view has a mask, mask.png");
  plugin.writer<marrow::Case>("", write_case,
                              "folder with case.yaml, ct.mha, images and cameras, to be read by read.case");
  plugin.writer<CaseFolder>("", write_folder,
                            "the same; with labels.mha, or with surfaces (.vtp) and without CT, if the case gives its "
                            "fragments so");
}
