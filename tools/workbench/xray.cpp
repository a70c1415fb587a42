// SPDX-License-Identifier: Apache-2.0
#include "workbench/xray.hpp"

#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/toolbox/files/samples_out.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// A camera as a draft's document has it.
json camera_json(const Camera& camera) {
  json written = json_of(camera);
  written["camera_from_world"] = {{"target", "camera"}, {"source", "world"}, {"matrix", written["camera_from_world"]}};
  return written;
}

/// Converts the camera file of another program into one of marrow's own. `open`: what the file leaves open.
fs::path converted_camera(const Workbench& workbench, const fs::path& file, const json& open,
                          const std::string& image) {
  PipelineCall call{workbench_pipeline("camera-file"),
                    {{{"image", workbench.folder.inside(image).string()}, {"camera", file.string()}}, {}}};
  for (const auto& [name, value] : open.items())
    call.arguments.overrides.push_back({"camera." + name, set_text(value)});
  return camera_file(workbench, camera_json(run(call, workbench).outputs.at("camera").as<Camera>()), image);
}

/// The camera of a view, with the distortion that is still in its image. Only marrow's own files hold one; for others
/// the result is empty. Throws Error if it cannot be read.
files::CameraInFile distorted_camera(const Workbench& workbench, const json& camera, const std::string& image) {
  const fs::path file = camera_file(workbench, camera, image);
  return file.extension() == ".yaml" || file.extension() == ".yml" ? files::read_camera_file(file)
                                                                   : files::CameraInFile();
}

/// The call that reads an image alone. `image` is relative to the opened folder.
NodeCall image_call(const Workbench& workbench, const std::string& image) {
  return {"read.image", {{"path", workbench.folder.inside(image).string()}}};
}

template <class Call>
Ran run_during_request(const Call& call, const Workbench& workbench) {
  Job job("", "");
  Ran ran{outputs_of(call, workbench, job), {}};
  const json events = job.state(0, 0)["events"];
  for (const json& event : events)
    if (event.value("event", "") == "warning") ran.warnings.push_back(event.value("text", ""));
  return ran;
}

/// An image as 16 bit numbers, low byte first, and `about`: width, height, and the grey value of a number n, which is
/// offset + scale * n.
std::string pixels_of(const Image& image, json& about) {
  cv::Mat stored;
  double offset = 0, scale = 1;
  if (image.pixels.depth() == CV_32F) {
    double least = 0, most = 0;
    cv::minMaxLoc(image.pixels, &least, &most);
    offset = least;
    scale = most > least ? (most - least) / 65535 : 1;
    image.pixels.convertTo(stored, CV_16U, 1 / scale, -offset / scale);
  } else {
    image.pixels.convertTo(stored, CV_16U);
  }
  about["width_px"] = stored.cols;
  about["height_px"] = stored.rows;
  about["offset"] = offset;
  about["scale"] = scale;
  return bytes_of_pixels(stored);
}

/// The warnings of a run that read a view, and doubts from the image's header. A camera given by angles has the
/// patient's axes, so the header is compared with it. Then the general doubts about sides are left out.
std::vector<std::string> with_sides(std::vector<std::string> warnings, const std::filesystem::path& image,
                                    const json& written, const Camera& camera) {
  if (!written.contains("c_arm")) return warnings;
  const std::vector<std::string> known = files::doubts_about_sides(image);
  std::erase_if(warnings, [&](const std::string& one) { return contains(known, one); });
  for (const std::string& doubt : files::doubts_about_sides(image, 0, camera)) warnings.push_back(doubt);
  return warnings;
}

/// The view. If it cannot be read, the image alone, with the reason as `fault`. Throws Error if the image cannot be
/// read.
Answer view_answer(const Workbench& workbench, const Request& request) {
  const std::string image = request.text("image");
  json about;
  std::string fault;
  try {
    const std::filesystem::path camera = camera_file(workbench, request.body.value("camera", json()), image);
    const std::string file = workbench.folder.inside(image).string();
    const NodeCall call{"read.view", {{"image", file}, {"camera", camera.string()}}};
    about["command"] = command_of(call);
    const Ran ran = run(call, workbench);
    const View& view = ran.outputs.at("view").as<View>();
    about["camera"] = json_of(view.camera);
    about["warnings"] = with_sides(ran.warnings, workbench.folder.inside(image), request.body["camera"], view.camera);
    about["is_straightened"] = !distorted_camera(workbench, request.body["camera"], image).distortion.is_none();
    std::string pixels = pixels_of(view.image, about);
    return bytes_answer(std::move(pixels), about);
  } catch (const Error& error) {
    fault = error.what();
  }
  const NodeCall call = image_call(workbench, image);
  about = {{"fault", printable_lines(fault)}, {"command", command_of(call)}, {"warnings", json::array()}};
  const Ran ran = run(call, workbench);
  std::string pixels = pixels_of(ran.outputs.at("image").as<Image>(), about);
  return bytes_answer(std::move(pixels), about);
}

void add_xray_views(Server& server, Workbench& workbench) {
  server.post("/api/xray/view", [&](const Request& request) { return view_answer(workbench, request); });
  server.get("/api/xray/image", [&](const Request& request) {
    const Ran ran = run(image_call(workbench, request.parameter("path")), workbench);
    json about;
    std::string bytes = pixels_of(ran.outputs.at("image").as<Image>(), about);
    return bytes_answer(std::move(bytes), about);
  });
  server.get("/api/xray/header-camera", [&](const Request& request) {
    const std::string image = workbench.folder.inside(request.parameter("image")).string();
    const NodeCall call{"camera.dicom", {{"paths", json::array({image})}, {"names", json::array({"view"})}}};
    const Ran ran = run(call, workbench);
    return json_answer({{"camera", camera_json(ran.outputs.at("camera").items.front().as<Camera>())},
                        {"warnings", ran.warnings},
                        {"command", command_of(call)}});
  });
}

// Painted masks. They are in .marrow/drafts until the case is saved, each under the digest of its content, so that
// undoing a stroke finds the old mask. A mask's file fits the image file (docs/case.md). But the page shows the image
// as a pipeline gets it, mirrored back and straightened, and paints on that.

/// How the shown image differs from its file.
struct Shown {
  bool is_mirrored = false;
  files::CameraInFile camera;  ///< without distortion if the image is not straightened
};

/// From the request's {image, camera}; `camera` is null if the image is shown without it.
Shown shown_in(const Workbench& workbench, const Request& request) {
  Shown shown;
  shown.is_mirrored = files::is_mirrored_as_read(workbench.folder.inside(request.text("image")));
  const json camera = request.body.value("camera", json());
  if (!camera.is_null()) shown.camera = distorted_camera(workbench, camera, request.text("image"));
  return shown;
}

cv::Mat1b mirrored_if(bool is_mirrored, const cv::Mat1b& mask) {
  cv::Mat1b mirrored = mask;
  if (is_mirrored) cv::flip(mask, mirrored, 1);
  return mirrored;
}

/// The mask of the file `mask` as the page shows it: a byte for each pixel, 0 or 255.
Answer shown_mask(const Workbench& workbench, const Request& request) {
  const std::filesystem::path file = workbench.folder.inside(request.text("mask"));
  const Ran ran = run(image_call(workbench, request.text("mask")), workbench);
  const Shown shown = shown_in(workbench, request);
  cv::Mat1b mask = mirrored_if(shown.is_mirrored != files::is_mirrored_as_read(file),
                               ran.outputs.at("image").as<Image>().pixels != 0);
  const Camera& camera = shown.camera.camera;
  if (shown.camera.is_distorted() && mask.cols == camera.width_px && mask.rows == camera.height_px)
    mask = files::straightened_mask(mask, shown.camera);
  return bytes_answer(bytes_of_pixels(mask), {{"width_px", mask.cols}, {"height_px", mask.rows}});
}

/// The mask of an image from the lengths of its runs, row after row: used pixels, unused pixels, used pixels and so on.
/// Throws Error unless the runs fill the image.
std::string mask_of(int width_px, int height_px, const json& runs) {
  const std::size_t count = std::size_t(width_px) * std::size_t(height_px);
  std::string mask;
  mask.reserve(count);
  bool is_used = true;
  for (const json& run : runs) {
    const std::size_t length = run.is_number_unsigned() ? run.get<std::size_t>() : count + 1;
    if (length > count - mask.size()) break;
    mask.append(length, is_used ? '\xff' : '\0');
    is_used = !is_used;
  }
  if (!runs.is_array() || mask.size() != count)
    throw Error(formatted("the mask does not fill its image of {} x {} pixels", width_px, height_px));
  return mask;
}

int side_of(const Request& request, const std::string& name) {
  const json side = request.body.value(name, json());
  if (!side.is_number_integer() || side < 1 || side > 65536)
    throw Error("'" + name + "' must be a whole number from 1 to 65536");
  return side.get<int>();
}

void add_xray_masks(Server& server, Workbench& workbench) {
  server.post("/api/xray/shown-mask", [&](const Request& request) { return shown_mask(workbench, request); });
  server.post("/api/xray/mask", [&](const Request& request) {
    const int width_px = side_of(request, "width_px"), height_px = side_of(request, "height_px");
    if (std::int64_t(width_px) * height_px > 400'000'000) throw Error("the image is too large for a mask");
    std::string bytes = mask_of(width_px, height_px, request.body.value("runs", json()));
    const Shown shown = shown_in(workbench, request);
    cv::Mat1b mask(height_px, width_px, reinterpret_cast<std::uint8_t*>(bytes.data()));
    if (shown.camera.is_distorted()) mask = files::original_mask(mask, shown.camera);
    mask = mirrored_if(shown.is_mirrored, mask);
    if (cv::countNonZero(mask) == width_px * height_px) return json_answer({{"mask", nullptr}});
    const auto* pixels = reinterpret_cast<const char*>(mask.ptr());
    const std::string png = files::png_of(width_px, height_px, 1, files::Sample::u8, pixels);
    const fs::path file = working_file(workbench.folder, "mask", ".png", png);
    return json_answer({{"mask", workbench.folder.relative(file)}});
  });
}

}  // namespace

fs::path camera_file(const Workbench& workbench, const json& camera, const std::string& image) {
  if (!camera.is_object() || camera.empty())
    throw Error("this view has no camera; give a camera file, or the angles and distances of the C-arm");
  if (const auto file = camera.find("file"); file != camera.end() && file->is_string()) {
    const fs::path place = workbench.folder.inside(file->get<std::string>());
    json open = camera;
    open.erase("file");
    return open.empty() ? place : converted_camera(workbench, place, open, image);
  }
  json written = camera;
  written["marrow-camera"] = 1;
  return working_file(workbench.folder, "camera", ".yaml", written.dump(1) + "\n");
}

std::vector<Override> overrides_of(const Workbench& workbench, const json& views) {
  json names = json::array(), images = json::array(), cameras = json::array();
  for (const json& view : views) {
    names.push_back(view.at("name"));
    images.push_back(workbench.folder.inside(view.at("image").get<std::string>()).string());
    cameras.push_back(camera_file(workbench, view.at("camera"), view.at("image").get<std::string>()).string());
  }
  return {{"views.names", set_text(names)}, {"views.images", set_text(images)}, {"views.cameras", set_text(cameras)}};
}

Ran run(const PipelineCall& call, const Workbench& workbench) { return run_during_request(call, workbench); }
Ran run(const NodeCall& call, const Workbench& workbench) { return run_during_request(call, workbench); }

void add_xray_page(Server& server, Workbench& workbench) {
  for (const auto add : {add_xray_views, add_xray_checks, add_xray_masks, add_xray_exchange, add_xray_export})
    add(server, workbench);
}

}  // namespace marrow::workbench
