// SPDX-License-Identifier: Apache-2.0
// Writes folders: a view, or a whole case in the format of read.case (docs/case.md).
#include <algorithm>
#include <cctype>
#include <map>
#include <marrow/domain/names.hpp>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/picture_out.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace {

namespace fs = std::filesystem;
using marrow::files::quoted;

/// PNG for images of 8 and 16 bits, TIFF for float images.
std::string image_name(const marrow::Image& image) { return image.pixels.depth() == CV_32F ? ".tif" : ".png"; }

/// Writes <stem>.png, <stem>.camera.yaml and <stem>.mask.png. With an empty stem: image.png, camera.yaml and mask.png.
struct ViewFiles {
  std::string image, camera, mask;
};
ViewFiles write_view_files(const marrow::View& view, const fs::path& folder, const std::string& stem) {
  const std::string dot = stem.empty() ? "" : stem + ".";
  ViewFiles files{(stem.empty() ? "image" : stem) + image_name(view.image), dot + "camera.yaml", ""};
  marrow::files::write_pixels(folder / files.image, view.image.pixels);
  marrow::files::write_plainly(folder / files.camera, {marrow::files::camera(view.camera)});
  if (!view.mask.empty()) {
    files.mask = dot + "mask.png";
    marrow::files::write_pixels(folder / files.mask, view.mask);
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

/// On some file systems, names that differ only in capital letters mean the same file.
std::string in_small_letters(std::string name) {
  for (char& c : name)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return name;
}

/// The file names of the views. A view's own name is used if it is plain, otherwise a number that no other view has.
std::vector<std::string> file_stems(const std::vector<std::string>& names) {
  std::vector<std::string> stems, taken;
  for (const std::string& name : names) taken.push_back(in_small_letters(name));
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::string stem = names[i];
    for (std::size_t number = i + 1;
         !is_plain(names[i]) && (stem == names[i] || std::count(taken.begin(), taken.end(), stem)); ++number)
      stem = "view-" + std::to_string(number);
    taken.push_back(stem);
    stems.push_back(stem);
  }
  return stems;
}

std::string views_text(const marrow::Case& value, const fs::path& folder) {
  std::string text = "views:\n";
  const std::vector<std::string> stems = file_stems(value.views.names());
  for (std::size_t i = 0; i < value.views.size(); ++i) {
    const ViewFiles files = write_view_files(value.views[i], folder, stems[i]);
    text += "  - name: " + quoted(value.views.name(i)) + "\n    image: " + files.image +
            "\n    camera: " + files.camera + "\n";
    if (!files.mask.empty()) text += "    mask: " + files.mask + "\n";
  }
  return text;
}

std::string fragments_text(const marrow::Case& value) {
  std::string text = "fragments:\n";
  for (std::size_t i = 0; i < value.seeds.size(); ++i) {
    const std::string& name = value.seeds.name(i);
    text += "  " + quoted(name) + ":\n" + marrow::files::seeds(value.seeds[i], "    ");
    if (const marrow::Pose* start = value.start.find(name))
      text += "    start:\n" + marrow::files::transform(start->world_from_model, "      ");
    if (const marrow::Truth* truth = value.truth.find(name))
      text += "    truth:\n" + marrow::files::transform(truth->world_from_model, "      ");
  }
  return text;
}

/// Throws Error if read.case would refuse the written case.
void check_case(const marrow::Case& value, const std::string& path) {
  if (value.views.empty()) throw marrow::Error(path + ": the case has no view");
  if (value.seeds.empty()) throw marrow::Error(path + ": the case has no fragment with seeds");
  const auto check_names = [&](const std::vector<std::string>& names, const std::string& what) {
    for (const std::string& name : names)
      if (const std::string fault = marrow::fault_of_item_name(name); !fault.empty())
        throw marrow::Error(path + ": the name " + quoted(name) + " of a " + what + " " + fault + "; choose another");
    for (std::size_t i = 0; i < names.size(); ++i)
      if (std::find(names.begin(), names.begin() + std::ptrdiff_t(i), names[i]) != names.begin() + std::ptrdiff_t(i))
        throw marrow::Error(path + ": two " + what + "s are named '" + names[i] + "'");
  };
  check_names(value.views.names(), "view");
  std::map<std::string, std::string> files;  // the key is in small letters
  for (const std::string& name : value.views.names())
    if (const auto [other, is_new] = files.emplace(in_small_letters(name), name); !is_new)
      throw marrow::Error(path + ": the views '" + other->second + "' and '" + name +
                          "' are one file to some file systems; rename one of them");
  check_names(value.seeds.names(), "fragment");
  const auto check = [&](const std::vector<std::string>& names, const std::string& what) {
    for (const std::string& name : names)
      if (!value.seeds.find(name))
        throw marrow::Error(path + ": fragment '" + name + "' has a " + what + " but no seeds");
  };
  check(value.start.names(), "start");
  check(value.truth.names(), "truth");
}

void write_case(const marrow::Case& value, const std::string& path) {
  check_case(value, path);
  marrow::files::write_atomically(path, [&](const fs::path& folder) {
    fs::create_directory(folder);
    marrow::files::write_grid(folder / "ct.mha", value.ct.grid, value.ct.values);
    marrow::files::write_plainly(folder / "case.yaml",
                                 {"marrow-case: 1\nct: ct.mha\n", views_text(value, folder), fragments_text(value)});
  });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<marrow::View>(
      "", view, "folder with image.png (image.tif for float), camera.yaml and, if the view has a mask, mask.png");
  plugin.writer<marrow::Case>("", write_case,
                              "folder with case.yaml, ct.mha, images and cameras, to be read by read.case");
}
