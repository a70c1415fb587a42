// SPDX-License-Identifier: Apache-2.0
// Painted masks. They are in .marrow/drafts until the case is saved, each under the digest of its content, so that
// undoing a stroke finds the old mask. A mask's file fits the image file (docs/case.md). But the page shows the image
// as a pipeline gets it, mirrored back and straightened, and paints on that.
#include <cstdint>
#include <opencv2/core.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/samples_out.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "workbench/xray.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

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

}  // namespace

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

}  // namespace marrow::workbench
