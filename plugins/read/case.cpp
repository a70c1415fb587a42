// SPDX-License-Identifier: Apache-2.0
// Reads a case: a patient's folder with case.yaml. This file names all other files of the case (docs/case.md).
#include <map>

#include "marrow/base/names.hpp"
#include "marrow/read/camera_file.hpp"
#include "marrow/read/case_fragments.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace {

namespace fs = std::filesystem;
using marrow::files::YamlFile, marrow::files::YamlMap;

constexpr std::size_t kMostViews = 1000;

using marrow::read::CaseFiles, marrow::read::file_in, marrow::read::read_or_fault;

struct Options {
  fs::path path;
  fs::path starts;
};

void read_ct(const fs::path& folder, const YamlMap& map, CaseFiles& result, marrow::Context& context) {
  if (!map.has("ct") && result.can_lack_ct()) return;
  const auto node = map.required("ct");
  if (!node) return;
  marrow::files::VolumeReading reading;
  std::optional<fs::path> file;
  if (node->IsMap()) {
    const YamlMap ct(map.file(), *node, "ct", {"file", "voxel_size_mm", "flip", "value_offset_hu", "series_uid"});
    file = file_in(folder, ct, "file");
    if (ct.has("voxel_size_mm"))
      if (const auto size = ct.vector3("voxel_size_mm")) reading.voxel_size_mm.assign(size->begin(), size->end());
    reading.flip = ct.texts_or_none("flip");
    if (ct.has("value_offset_hu")) reading.value_offset_hu = ct.number("value_offset_hu").value_or(0);
    if (ct.has("series_uid")) reading.series_uid = ct.text("series_uid").value_or("");
  } else {
    file = file_in(folder, map, "ct");
  }
  if (!file) return;
  const auto tell = [&](const std::string& line) { context.info(line); };
  auto volume = read_or_fault(map, "ct", [&] { return marrow::files::read_volume_file(*file, reading, tell); });
  if (!volume) return;
  marrow::files::warn_of_offset(*volume, *file, reading.value_offset_hu, context);
  result.ct = std::move(*volume);
}

/// What a map says about the camera file of another program.
marrow::read::CameraReading camera_reading(const YamlMap& map) {
  marrow::read::CameraReading reading;
  if (map.has("projection")) {
    reading.projection = map.integer("projection").value_or(0);
    if (reading.projection < 0) map.fault("projection", "projection: expected a whole number from 0");
  }
  const auto two = [&](const std::string& key) { return map.numbers(key, 2).value_or(std::vector<double>()); };
  if (map.has("scale")) {
    reading.scale = map.number("scale").value_or(1);
    if (!(reading.scale >= 1e-6)) map.fault("scale", "scale: expected a factor of at least 1e-6, such as 10 for cm");
  }
  if (map.has("pixel_mm")) reading.size.pixel_mm = two("pixel_mm");
  if (map.has("corner_mm")) reading.size.corner_mm = two("corner_mm");
  const std::string mirror = map.has("mirror") ? map.text("mirror").value_or("none") : "none";
  if (mirror != "none" && mirror != "left_right" && mirror != "upside_down")
    map.fault("mirror", "mirror: expected none, left_right or upside_down, got '" + mirror + "'");
  reading.mirror = marrow::exchange::mirror_of(mirror);
  return reading;
}

/// The camera of the view with this image.
std::optional<marrow::files::CameraInFile> read_camera(const fs::path& folder, const YamlMap& map,
                                                       const std::optional<marrow::Image>& image,
                                                       marrow::Context& context) {
  const auto node = map.required("camera");
  if (!node) return std::nullopt;
  const bool is_map = node->IsMap(), names_file = is_map && (*node)["file"];
  if (is_map && !names_file) return marrow::files::camera_from(*node, map.file());
  marrow::read::CameraReading reading;
  marrow::geometry::CameraDeviations deviations;
  std::optional<fs::path> file;
  if (names_file) {
    const YamlMap camera(map.file(), *node, "camera",
                         {"file", "projection", "pixel_mm", "corner_mm", "mirror", "scale", "deviations"});
    file = file_in(folder, camera, "file");
    reading = camera_reading(camera);
    deviations = with_deviations(camera, deviations);
  } else {
    file = file_in(folder, map, "camera");
  }
  if (!file) return std::nullopt;
  const auto format = marrow::read::camera_format(*file);
  if (format == marrow::read::CameraFormat::rtk || format == marrow::read::CameraFormat::plastimatch) {
    if (!image) return std::nullopt;  // the file does not say how large it is
    reading.size.size_px = {double(image->width()), double(image->height())};
  }
  auto read = read_or_fault(map, "camera", [&] { return marrow::read::read_camera(*file, reading); });
  if (!read) return std::nullopt;
  if (!deviations.is_none()) read->deviations = deviations;  // the case knows more than the file
  if (const auto doubt = marrow::read::doubt_about_unit(*file, read->camera, reading.scale); !doubt.empty())
    context.warn(doubt);
  return read;
}

std::optional<marrow::Image> read_image(const fs::path& folder, const YamlMap& map, const std::string& key) {
  const auto file = file_in(folder, map, key);
  if (!file) return std::nullopt;
  return read_or_fault(map, key, [&] { return marrow::files::read_image_file(*file); });
}

/// The mask belongs to the image as it is stored. If the image is mirrored when it is read, the mask is mirrored too.
std::optional<cv::Mat> read_mask(const fs::path& folder, const YamlMap& map, bool has_image) {
  const auto mask = read_image(folder, map, "mask");
  if (!mask) return std::nullopt;
  if (mask->pixels.type() != CV_8U)
    map.fault("mask", "mask: expected an image of 8 bits, zero where the view may not be used");
  if (marrow::files::is_lossy_image(file_in(folder, map, "mask").value()))
    map.fault("mask",
              "mask: was compressed with loss (JPEG or the like), so its zeros may have changed; save the mask as PNG");
  const auto is_mirrored = [&](const std::string& key) {
    return marrow::files::is_mirrored_as_read(file_in(folder, map, key).value());
  };
  if (!has_image || is_mirrored("image") == is_mirrored("mask")) return mask->pixels;
  cv::Mat mirrored;
  cv::flip(mask->pixels, mirrored, 1);
  return mirrored;
}

/// Warns of what is doubtful about the image's file. A camera given by angles uses the patient's axes, as the header of
/// the image does.
void warn_of_image(const fs::path& folder, const YamlMap& map, const marrow::Camera& camera, marrow::Context& context) {
  const fs::path image = file_in(folder, map, "image").value();
  const YAML::Node written = map.node("camera");
  const bool has_patient_axes = written.IsMap() && written["c_arm"];
  for (const std::string& doubt : has_patient_axes ? marrow::files::doubts_about_sides(image, 0, camera)
                                                   : marrow::files::doubts_about_sides(image))
    context.warn(doubt);
  marrow::files::warn_of_pixels(image, context);
}

void read_view(const fs::path& folder, const YamlMap& map, CaseFiles& result, marrow::Context& context) {
  const auto name = map.text("name");
  if (name)
    if (const std::string fault = marrow::fault_of_item_name(*name); !fault.empty())
      return map.fault("name", "name: the name of a view " + fault + "; choose another");
  const auto image = read_image(folder, map, "image");
  const auto camera = read_camera(folder, map, image, context);
  marrow::View view;
  if (map.has("mask")) {
    const auto mask = read_mask(folder, map, image.has_value());
    if (!mask) return;
    view.mask = *mask;
  }
  if (!name || !image || !camera) return;
  if (result.views.find(*name)) return map.fault("name", "name: two views are named '" + *name + "'");
  view.name = *name;
  view.image = *image;
  view.camera = camera->camera;
  warn_of_image(folder, map, view.camera, context);
  try {
    check_view(view);
    marrow::files::straighten(view, *camera);
  } catch (const marrow::Error& error) {
    return map.fault("image", error.what());
  }
  result.views.add(*name, std::move(view));
  result.camera_deviations.add(*name, camera->deviations);
}

void read_views(const fs::path& folder, const YamlMap& map, CaseFiles& result, marrow::Context& context) {
  const auto views = map.required("views");
  if (!views) return;
  if (!views->IsSequence() || views->size() == 0)
    return map.fault("views", "views: expected a list of views, each with name, image and camera");
  if (views->size() > kMostViews)
    return map.fault("views", marrow::formatted("views: there are {}; at most 1000 are read", views->size()));
  for (const auto& item : *views) {
    const YamlMap view(map.file(), item, "a view", {"name", "image", "camera", "mask"});
    if (view.valid()) read_view(folder, view, result, context);
  }
}

/// The poses in a folder that holds a file FRAGMENT.yaml for each fragment to register.
marrow::List<marrow::Pose> read_starts(const fs::path& folder, const std::vector<std::string>& fragments) {
  std::error_code failure;
  if (!fs::is_directory(folder, failure))
    throw marrow::Error(folder.string() +
                        ": expected a folder with a pose for each fragment, such as the output 'pose' of a run");
  std::map<std::string, fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".yaml")
      files[marrow::files::unescaped_name(entry.path().stem().string())] = entry.path();
  marrow::List<marrow::Pose> starts;
  for (const std::string& fragment : fragments) {
    const auto file = files.find(fragment);
    if (file == files.end())
      throw marrow::Error(folder.string() + ": there is no pose of the fragment '" + fragment +
                          "'; a pose file is named after its fragment, such as distal.yaml");
    marrow::Pose start;
    start.world_from_model = marrow::files::read_pose_file(file->second).world_from_model;
    starts.add(fragment, start);
  }
  return starts;
}

CaseFiles read_case(const Options& options, marrow::Context& context) {
  std::error_code failure;
  if (!fs::is_directory(options.path, failure))
    throw marrow::Error(
        options.path.string() + ": expected the folder of a case, which holds case.yaml" +
        (fs::exists(options.path, failure) ? " (name the folder, not a file in it)" : "; there is no such folder"));
  marrow::files::check_stays_inside(options.path, options.path / "case.yaml");
  YamlFile file(options.path / "case.yaml");
  const YamlMap map(file, file.root(), "case", {"marrow-case", "ct", "labels", "views", "fragments"});
  marrow::files::check_version(map, "marrow-case");
  CaseFiles result;
  read_fragments(options.path, map, result, context);
  read_views(options.path, map, result, context);
  read_ct(options.path, map, result, context);
  file.finish();
  if (!options.starts.empty()) result.start = read_starts(options.starts, result.registered);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.case", read_case)
      .summary(
          "Reads the case of one patient: CT, views with cameras, each fragment by seeds, a label or a surface, and "
          "start and truth if they are given")
      .out("ct", &CaseFiles::ct, "CT in Hounsfield units; it may be missing where the case gives labels or surfaces")
      .out("seeds", &CaseFiles::seeds, "points inside each fragment, if the case gives them", marrow::over("fragment"))
      .out("label", &CaseFiles::label, "mask of each fragment, if the case gives labels: 1 inside, 0 outside",
           marrow::over("fragment"))
      .out("surface", &CaseFiles::surface, "surface of each fragment, if the case gives them", marrow::over("fragment"))
      .out("views", &CaseFiles::views, "X-ray views with cameras", marrow::over("view"))
      .out("camera_deviations", &CaseFiles::camera_deviations,
           "how exactly each camera is known, as the case or the camera file states it", marrow::over("view"))
      .out("start", &CaseFiles::start, "pose to start from, if the case gives one", marrow::over("fragment"))
      .out("truth", &CaseFiles::truth, "exact pose, if the case gives one (simulated cases)", marrow::over("fragment"))
      .option("path", &Options::path, "folder of the case, with case.yaml", marrow::required())
      .option("starts", &Options::starts,
              "folder with a pose file for each fragment, such as the output 'pose' of a run; these poses take the "
              "place of the case's starts");
}
