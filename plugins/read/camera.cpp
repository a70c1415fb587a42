// SPDX-License-Identifier: Apache-2.0
// A camera in marrow's format or in that of another program. What such a program's file leaves open comes from options.
#include <marrow/plugin.hpp>

#include "marrow/read/camera_file.hpp"

namespace {

using namespace marrow;

struct Options {
  std::filesystem::path path;
  int projection = 0;
  std::vector<double> image_size_px, pixel_mm, corner_mm;
  std::string mirror = "none";
  double scale = 1;
};

/// If the file gives the size of its images, a wired image must have this size, and image_size_px is refused.
Camera camera(const Image* image, const Options& options, Context& context) {
  const read::CameraFormat format = read::camera_format(options.path);
  const bool is_alone = format == read::CameraFormat::own || format == read::CameraFormat::xmalab ||
                        format == read::CameraFormat::maya,
             has_size = is_alone || format == read::CameraFormat::xreg;
  if (has_size && !options.image_size_px.empty())
    throw Error(options.path.string() + ": image_size_px is not for this format of cameras; leave it out");
  read::CameraReading reading{options.projection,
                              {options.image_size_px, options.pixel_mm, options.corner_mm},
                              exchange::mirror_of(options.mirror),
                              options.scale};
  if (reading.projection == 0 &&
      (is_alone || format == read::CameraFormat::plastimatch || format == read::CameraFormat::jointtrack))
    reading.projection = -1;  // the default
  if (image) reading.size.size_px = {double(image->width()), double(image->height())};
  const files::CameraInFile read = read::read_camera(options.path, reading);
  if (read.is_distorted())
    context.warn(
        options.path.string() +
        ": the images of this camera are distorted; only read.view, read.views and read.case remove the distortion, if "
        "they read the camera file themselves. This camera is that of the image without distortion");
  if (!read.deviations.is_none())
    context.warn(options.path.string() +
                 ": states how exactly the camera is known; only read.view, read.views and read.case pass that on, if "
                 "they read the camera file themselves");
  if (const std::string doubt = read::doubt_about_unit(options.path, read.camera, options.scale); !doubt.empty())
    context.warn(doubt);
  return read.camera;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.camera", camera)
      .summary(
          "Reads a camera from marrow's YAML, or from a file of XMALab, MayaCam, plastimatch, RTK, xReg or JointTrack")
      .in("image", "the image: plastimatch, RTK and JointTrack take its size, and others compare theirs with it")
      .out("camera", "the camera")
      .option("path", &Options::path,
              "camera file; .yaml: marrow's own format, .xml: RTK's geometry, .h5: xReg's projection data, any other "
              "end: the text of plastimatch, XMALab, JointTrack or a MayaCam of version 1",
              required())
      .option("projection", &Options::projection, "RTK and xReg: number of the projection, counted from 0", at_least(0))
      .option("image_size_px", &Options::image_size_px,
              "plastimatch, RTK and JointTrack: width and height of the image; or wire the image")
      .option("pixel_mm", &Options::pixel_mm,
              "RTK: width and height of a pixel on the detector; one number for square pixels")
      .option("corner_mm", &Options::corner_mm,
              "RTK: the origin of its images: the place (u, v) of the first pixel's centre on the detector; empty: the "
              "image is centred")
      .option("mirror", &Options::mirror,
              "RTK and xReg: how their images are turned over before use, as by the same option of read.view or "
              "read.image; they are seen from the detector, or have their rows from below",
              one_of({"none", "left_right", "upside_down"}))
      .option(
          "scale", &Options::scale,
          "factor that converts the unit of the camera file to mm: 10 for cm, 1000 for metres; not for marrow's YAML",
          at_least(1e-6));
}
