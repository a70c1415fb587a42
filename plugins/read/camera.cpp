// SPDX-License-Identifier: Apache-2.0
// A camera in marrow's format or in that of another program. What such a program's file leaves open comes from options.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/plastimatch_camera.hpp"
#include "marrow/toolbox/exchange/projections.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace {

using namespace marrow;

struct Options {
  std::filesystem::path path;
  int projection = 0;
  std::vector<double> size_px, pixel_mm, corner_mm;
  std::string mirror = "none";
};

enum class Format { own, plastimatch, rtk, xreg };

Format format_of(const std::filesystem::path& path) {
  std::string end = path.extension().string();
  for (char& c : end) c = char(std::tolower(static_cast<unsigned char>(c)));
  if (end == ".yaml" || end == ".yml") return Format::own;
  const exchange::Projections projections = exchange::projections_in(path);
  if (projections == exchange::Projections::rtk) return Format::rtk;
  if (projections == exchange::Projections::xreg) return Format::xreg;
  return exchange::is_plastimatch_camera(path) ? Format::plastimatch : Format::own;
}

/// An option that the file's format does not need would be ignored, so it is refused.
void check_needed(const Options& options, bool has_image, Format format) {
  const bool is_rtk = format == Format::rtk, is_xreg = format == Format::xreg;
  const auto check = [&](bool is_given, bool is_needed, const char* name) {
    if (is_given && !is_needed)
      throw Error(options.path.string() + ": " + name + " is not for this format of cameras; leave it out");
  };
  check(options.projection != 0, is_rtk || is_xreg, "projection");
  check(!options.size_px.empty(), is_rtk || format == Format::plastimatch, "size_px");
  check(has_image, is_rtk || format == Format::plastimatch, "the input image");
  check(!options.pixel_mm.empty(), is_rtk, "pixel_mm");
  check(!options.corner_mm.empty(), is_rtk, "corner_mm");
  check(options.mirror != "none", is_rtk || is_xreg, "mirror");
}

Camera own_camera(const std::filesystem::path& path, Context& context) {
  const DistortedCamera file = files::read_camera_file(path);
  if (!file.distortion.is_none())
    context.warn(path.string() +
                 ": the images of this camera are distorted, which only read.view, read.views and read.case remove, "
                 "with the camera file as their option; the camera is that of the image without distortion");
  return file.camera;
}

Camera camera(const Image* image, const Options& options, Context& context) {
  const Format format = format_of(options.path);
  check_needed(options, image != nullptr, format);
  if (format == Format::own) return own_camera(options.path, context);
  exchange::ImageSize size{options.size_px, options.pixel_mm, options.corner_mm};
  if (image) size.size_px = {double(image->width()), double(image->height())};
  if (format == Format::plastimatch) return exchange::read_plastimatch_camera(options.path, size);
  return exchange::read_projections(options.path, {options.projection}, size, exchange::mirror_of(options.mirror))[0];
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.camera", camera)
      .summary("Reads a camera from marrow's YAML, or from a file of XMALab, plastimatch, RTK or xReg")
      .in("image", "plastimatch and RTK: the image, whose size is taken")
      .out("camera", "the camera")
      .option("path", &Options::path,
              "camera file; .yaml: marrow's own format, .xml: RTK's geometry, .h5: xReg's projection data, any other "
              "end: the text of plastimatch or XMALab",
              required())
      .option("projection", &Options::projection, "RTK and xReg: number of the projection, counted from 0", at_least(0))
      .option("size_px", &Options::size_px, "plastimatch and RTK: width and height of the image; or wire the image")
      .option("pixel_mm", &Options::pixel_mm,
              "RTK: width and height of a pixel on the detector; one number for square pixels")
      .option(
          "corner_mm", &Options::corner_mm,
          "RTK: the origin of its images, which is the place (u, v) of the first pixel's centre on the detector; if "
          "empty, the image is centred")
      .option("mirror", &Options::mirror,
              "RTK and xReg: how their images, which are seen from the detector or have rows from below, are turned "
              "over before use, as by the same option of read.view or read.image",
              one_of({"none", "left_right", "upside_down"}));
}
