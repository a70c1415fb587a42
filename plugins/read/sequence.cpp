// SPDX-License-Identifier: Apache-2.0
// A sequence of X-ray images: for each view a folder of images, a file with several frames, or a video.
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/read/camera_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/track/track_state.hpp"
#include "video.hpp"

namespace {

using namespace marrow;
using track::SequenceFrame;

namespace fs = std::filesystem;

struct Options : files::FrameRange {
  std::vector<std::string> names;
  std::vector<fs::path> images;
  std::vector<std::string> patterns;
  std::vector<fs::path> cameras;
  fs::path calibration;
  std::vector<fs::path> distortions;
  double scale = 1;
};

std::vector<Image> read_images(const fs::path& path, const std::string& pattern, const Options& options,
                               Context& context) {
  if (!fs::is_directory(path)) {
    if (!pattern.empty())
      throw Error(path.string() + ": a pattern chooses files of a folder, but this is not a folder; leave it out");
    const char* const container = read::video_container(path);
    if (container) return read::read_video(path, container, options);
    files::warn_of_pixels(path, context);
    return files::read_image_frames(path, options);
  }
  const std::vector<fs::path> all = files::frame_files(path, pattern);
  std::vector<Image> images;
  files::warn_of_pixels(all.front(), context);  // the others are alike
  for (const int frame : files::frames_of(options, int(all.size()), path.string())) {
    context.check_cancelled();
    images.push_back(files::read_image_file(all[std::size_t(frame - 1)]));
    const cv::Mat &first = images.front().pixels, &now = images.back().pixels;
    if (now.size() != first.size() || now.type() != first.type())
      throw Error(
          formatted("{}: frame {} has {} x {} pixels of {} bits, but the first one {} x {} of {}; all frames of a view "
                    "must be alike",
                    all[std::size_t(frame - 1)].string(), frame, now.cols, now.rows, 8 * now.elemSize1(), first.cols,
                    first.rows, 8 * first.elemSize1()));
  }
  return images;
}

List<SequenceFrame> sequence(const List<Camera>* cameras, const Options& options, Context& context) {
  if (!cameras && options.cameras.empty()) throw Error("the node that is wired to 'camera' gave none");
  std::vector<SequenceFrame> frames;
  for (std::size_t i = 0; i < options.names.size(); ++i) {
    const std::string& name = options.names[i];
    check_item_name("view", name);
    const std::string pattern = options.patterns.empty() ? std::string() : options.patterns.at(i);
    std::vector<Image> images = read_images(options.images.at(i), pattern, options, context);
    if (i == 0) frames.resize(images.size());
    if (images.size() != frames.size())
      throw Error(formatted("view '{}' has {} frames, but view '{}' has {} ({}); all views must show the same moments",
                            name, images.size(), options.names.front(), frames.size(), options.images.at(i).string()));
    read::ViewSource source{name,
                            {},
                            cameras ? &read::camera_of_view(name, *cameras) : nullptr,
                            cameras ? fs::path() : options.cameras.at(i),
                            options.calibration,
                            options.distortions.empty() ? fs::path() : options.distortions.at(i)};
    source.scale = options.scale;
    const read::ViewCamera camera = read::read_view_camera(source, images.front(), context);
    for (std::size_t k = 0; k < images.size(); ++k) {
      context.check_cancelled();
      frames[k].views.push_back(read::view_of(name, std::move(images[k]), camera));
      context.progress(double(k + 1) / double(images.size()), name);
    }
  }
  List<SequenceFrame> result;
  for (std::size_t k = 0; k < frames.size(); ++k)
    result.add(track::frame_name(std::size_t(options.first) + k * std::size_t(options.every)), std::move(frames[k]));
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.sequence", sequence)
      .summary("Reads a sequence of X-ray views: folders of images, files with several frames, or videos")
      .in("camera", "one camera per view, with the view's name, if no camera files are given", over("view"))
      .out("frames", "all views of each moment, named by the number of the frame; a known distortion is removed",
           over("frame"))
      .option("names", &Options::names, "one name per view", required())
      .relation(at_least_one({"names"}))
      .relation(distinct("names"))
      .option("images", &Options::images,
              "per view: a folder of images (PNG, TIFF, DICOM, ...) whose names differ only in a number, a file with "
              "several pages or frames (TIFF, DICOM), or a video (AVI, MP4, MOV, MKV, WebM, WMV, MPEG) of up to 16 "
              "bits; colours of a video become grey",
              required())
      .relation(same_length({"names", "images"}))
      .option("patterns", &Options::patterns,
              "per view: which files of its folder belong to it, as 'frontal_*.png' or '*/frontal.png'; * stands for "
              "any characters, ? for one. Empty: all images of the folder")
      .relation(as_many_or_none("patterns", "names"))
      .option("cameras", &Options::cameras,
              "one camera file (marrow's YAML, or a file of XMALab, MayaCam, plastimatch or xReg) per view")
      .relation(exactly_one({"in.camera", "cameras"}))
      .relation(as_many_or_none("cameras", "names"))
      .option("calibration", &Options::calibration,
              "calibration file of the device that took all views; its camera matrix replaces those of the cameras, "
              "and its distortion is removed from the images")
      .option(
          "distortions", &Options::distortions,
          "one distortion file of camera.distortion_plate per view; the frames are straightened by it and masked out "
          "where it was not measured")
      .relation(as_many_or_none("distortions", "names"))
      .option(
          "scale", &Options::scale,
          "factor that converts the unit of the camera files to mm: 10 for cm, 1000 for metres; not for marrow's YAML",
          at_least(1e-6))
      .option("first", &Options::first, "first frame that is read, counted from 1", at_least(1))
      .option("last", &Options::last, "last frame that is read; 0: to the end", at_least(0))
      .option("every", &Options::every, "2: every second frame is read", at_least(1));
}
