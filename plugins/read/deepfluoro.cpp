// SPDX-License-Identifier: Apache-2.0
// A bone and X-ray images of the DeepFluoro data set. The world is the bone's place in the CT, so the true pose is the
// identity, and images of one specimen, which were taken from all sides, are views of one scene.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/toolbox/exchange/deepfluoro_file.hpp"

namespace {

using namespace marrow;
using exchange::DeepfluoroFile, exchange::DeepfluoroImage, exchange::DeepfluoroView;

struct Options {
  std::filesystem::path path;
  std::string specimen;
  std::vector<std::string> images;
  int number = 0;
  std::string bone = "pelvis";
  int border_px = 50;
  double margin_mm = 10;
  double most_px = 30;
};

struct Read {
  Volume ct;
  List<Volume> label;
  List<View> views;
  List<Landmarks> landmarks;
  List<Pose> start;
  List<Truth> truth;
};

/// The images that the options name, all of one specimen.
std::vector<DeepfluoroImage> chosen(const DeepfluoroFile& file, const Options& options) {
  const auto& all = file.images();
  if (options.number > 0) {
    if (!options.specimen.empty() || !options.images.empty())
      throw Error("number counts the images of all specimens; leave specimen and images out");
    if (std::size_t(options.number) > all.size())
      throw Error(formatted("number: the file has {} images, so there is no image {}", all.size(), options.number));
    return {all[std::size_t(options.number - 1)]};
  }
  const std::vector<std::string> specimens = file.specimens();
  if (std::find(specimens.begin(), specimens.end(), options.specimen) == specimens.end())
    throw Error("specimen: the file has no '" + options.specimen + "'; " + suggestion(options.specimen, specimens));
  std::vector<std::string> known;
  for (const DeepfluoroImage& image : all)
    if (image.specimen == options.specimen) known.push_back(image.name);
  if (options.images.empty()) throw Error("images: name at least one, such as " + known.front());
  std::vector<DeepfluoroImage> images;
  for (const std::string& name : options.images) {
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error("images: specimen '" + options.specimen + "' has no '" + name + "'; " + suggestion(name, known));
    images.push_back({options.specimen, name});
  }
  return images;
}

/// The part of the CT that holds the region, with a margin.
void crop(Volume& ct, std::vector<std::uint8_t>& inside, double margin_mm) {
  std::array<int, 3> low = ct.grid.size, high{0, 0, 0};
  for (int z = 0; z < ct.grid.size[2]; ++z)
    for (int y = 0; y < ct.grid.size[1]; ++y)
      for (int x = 0; x < ct.grid.size[0]; ++x) {
        if (!inside[ct.grid.offset(x, y, z)]) continue;
        const std::array<int, 3> at{x, y, z};
        for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k] + 1);
      }
  Grid grid = ct.grid;
  for (int k = 0; k < 3; ++k) {
    const int margin = int(std::ceil(margin_mm / grid.spacing_mm[k]));
    low[k] = std::max(0, low[k] - margin);
    high[k] = std::min(ct.grid.size[k], high[k] + margin);
    grid.size[k] = high[k] - low[k];
  }
  grid.origin_mm = ct.grid.point_from_index(Eigen::Vector3d(low[0], low[1], low[2]));
  Volume part{grid, {}};
  std::vector<std::uint8_t> kept;
  part.values.reserve(grid.count());
  for (int z = low[2]; z < high[2]; ++z)
    for (int y = low[1]; y < high[1]; ++y) {
      const auto row = std::ptrdiff_t(ct.grid.offset(low[0], y, z));
      part.values.insert(part.values.end(), ct.values.begin() + row, ct.values.begin() + row + grid.size[0]);
      kept.insert(kept.end(), inside.begin() + row, inside.begin() + row + grid.size[0]);
    }
  ct = std::move(part);
  inside = std::move(kept);
}

/// Throws Error if the landmarks of the CT do not lie where the image marks them.
void check_landmarks(const DeepfluoroView& view, const std::vector<Landmarks::Point>& points,
                     const DeepfluoroImage& image, double most_px) {
  std::vector<double> off_px;
  for (const exchange::ShownLandmark& shown : view.landmarks)
    for (const Landmarks::Point& point : points)
      if (point.name == shown.name) off_px.push_back((project(view.camera, point.model_mm) - shown.pixel).norm());
  if (off_px.empty() || most_px == 0) return;
  std::sort(off_px.begin(), off_px.end());
  const double median = off_px[off_px.size() / 2];
  if (median <= most_px) return;
  throw Error(
      formatted("image {}/{}: its landmarks lie {} px (median) from where the file marks them, at most {:g} are "
                "allowed: a matrix is not what the file should have; 'marrow data check FILE' says which",
                image.specimen, image.name,
                std::isfinite(median) ? formatted("{:.0f}", median) : std::string("infinitely many"), most_px));
}

View view_of(const DeepfluoroFile& file, const DeepfluoroImage& image, const DeepfluoroView& seen, int border_px) {
  View view{image.name, file.pixels(image, seen), seen.camera, {}};
  if (2 * border_px >= std::min(seen.camera.width_px, seen.camera.height_px))
    throw Error(formatted("border_px: {} px on each side leave nothing of the image of {} x {} px", border_px,
                          seen.camera.width_px, seen.camera.height_px));
  if (border_px > 0) {
    view.mask = cv::Mat::zeros(view.image.pixels.size(), CV_8U);
    view.mask(cv::Rect(border_px, border_px, seen.camera.width_px - 2 * border_px,
                       seen.camera.height_px - 2 * border_px)) = 255;
  }
  check_view(view);
  return view;
}

Read deepfluoro(const Options& options, Context& context) {
  const DeepfluoroFile file(options.path);
  const std::vector<DeepfluoroImage> images = chosen(file, options);
  const std::string specimen = images.front().specimen;
  Landmarks landmarks{file.landmarks(specimen), {}, {}};
  Read read;
  for (const DeepfluoroImage& image : images) {
    const DeepfluoroView seen = file.view(image, options.bone, {});
    check_landmarks(seen, landmarks.points, image, options.most_px);
    if (!file.shows(image, options.bone))
      context.warn("image " + specimen + "/" + image.name + ": the file says that it shows too little of the " +
                   options.bone + " for its pose to be right");
    for (const exchange::ShownLandmark& shown : seen.landmarks)
      landmarks.seen.push_back({shown.name, image.name, shown.pixel});
    read.views.add(image.name, view_of(file, image, seen, options.border_px));
  }
  read.ct = file.ct(specimen);
  std::vector<std::uint8_t> inside = file.labelled(specimen, options.bone, read.ct.grid);
  if (std::find(inside.begin(), inside.end(), 1) == inside.end())
    throw Error("no voxel of specimen " + specimen + " has a label of the " + options.bone);
  crop(read.ct, inside, options.margin_mm);
  read.label.add(options.bone, {read.ct.grid, {inside.begin(), inside.end()}});
  read.landmarks.add(options.bone, std::move(landmarks));
  read.start.add(options.bone, {});
  read.truth.add(options.bone, {});
  context.info("specimen " + specimen +
               formatted(", {} of the file's {}", counted(images.size(), "image"), file.images().size()));
  return read;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.deepfluoro", deepfluoro)
      .summary(
          "Reads a bone and X-ray images of a specimen from the file of the DeepFluoro data set (Grupp et al., IJCARS "
          "2020); the world is the bone's place in the CT")
      .out("ct", &Read::ct, "CT in Hounsfield units, of the bone and its surroundings")
      .out("label", &Read::label, "mask of the bone, from the file's labels: 1 inside, 0 outside", over("fragment"))
      .out("views", &Read::views, "images with cameras, seen from the source; bright = air", over("view"))
      .out("landmarks", &Read::landmarks, "landmarks in the CT and in the images", over("fragment"))
      .out("start", &Read::start, "the true pose, for experiments that displace it", over("fragment"))
      .out("truth", &Read::truth, "the pose that the data set gives: the identity", over("fragment"))
      .option("path", &Options::path, "the HDF5 file of full resolution", required())
      .option("specimen", &Options::specimen, "such as 17-1882")
      .option("images", &Options::images, "names of the specimen's images, such as 000")
      .option("number", &Options::number,
              "in place of specimen and images: one image by its number in the file, from 1; 0: not given", at_least(0))
      .option("bone", &Options::bone, "whose pose is wanted", one_of({"pelvis", "left-femur", "right-femur"}))
      .option("border_px", &Options::border_px, "border that the collimator covers, masked out", at_least(0))
      .option("margin_mm", &Options::margin_mm, "how much of the CT is kept around the bone", at_least(0))
      .option("most_px", &Options::most_px,
              "median distance of the landmarks from where the images show them that is allowed; 0: any", at_least(0));
}
