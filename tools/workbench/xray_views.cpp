// SPDX-License-Identifier: Apache-2.0
// Pixels and cameras of X-ray views, for the page to show.
#include <algorithm>
#include <cstring>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/toolbox/files/image_sides.hpp"
#include "workbench/xray.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

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

}  // namespace

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

}  // namespace marrow::workbench
