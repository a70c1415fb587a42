// SPDX-License-Identifier: Apache-2.0
// Whether all signs of a DeepFluoro file fit: each landmark of a CT, seen by the camera that the file gives an image,
// must lie where the file marks it. A matrix that is inverted, or an axis that runs the other way, shows at once.
#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/calibration/plausibility.hpp"
#include "marrow/toolbox/exchange/deepfluoro_file.hpp"

namespace {

using namespace marrow;
using calibration::SeenPoints;
using exchange::DeepfluoroFile, exchange::DeepfluoroImage, exchange::DeepfluoroReading, exchange::DeepfluoroView;

struct Options {
  std::filesystem::path path;
  double most_px = 30;
};

/// The images of a specimen under one reading of the file: their cameras, and the landmarks that both sides have.
struct Read {
  std::vector<Camera> cameras;
  std::vector<SeenPoints> points;
  std::vector<double> off_px;  ///< of all landmarks, ascending

  double median_px() const {
    return off_px.empty() ? std::numeric_limits<double>::infinity() : off_px[off_px.size() / 2];
  }
};

Read read(const DeepfluoroFile& file, const std::string& specimen, const DeepfluoroReading& reading) {
  Read read;
  const std::vector<Landmarks::Point> known = file.landmarks(specimen);
  for (const DeepfluoroImage& image : file.images()) {
    if (image.specimen != specimen) continue;
    const DeepfluoroView view = file.view(image, "pelvis", reading);
    SeenPoints points;
    for (const exchange::ShownLandmark& shown : view.landmarks)
      for (const Landmarks::Point& point : known) {
        if (point.name != shown.name) continue;
        points.world_mm.push_back(point.model_mm);
        points.pixels.push_back(shown.pixel);
        const double off = (project(view.camera, point.model_mm) - shown.pixel).norm();
        read.off_px.push_back(std::isfinite(off) ? off : std::numeric_limits<double>::infinity());
      }
    read.cameras.push_back(view.camera);
    read.points.push_back(std::move(points));
  }
  std::sort(read.off_px.begin(), read.off_px.end());
  return read;
}

std::string pixels_text(double px) { return std::isfinite(px) ? formatted("{:.4g} px", px) : "no finite distance"; }

/// What would have to be changed for the landmarks to fit; empty if nothing known explains them.
std::string remedy(const DeepfluoroFile& file, const std::string& specimen, const Read& as_is, double most_px) {
  struct Other {
    DeepfluoroReading reading;
    const char* change;
  };
  for (const Other& other : {Other{{true, false, false}, "'extrinsic' of 'proj-params' is inverted"},
                             Other{{false, true, false}, "the poses 'cam-to-pelvis-vol' are inverted"},
                             Other{{true, true, false}, "'extrinsic' and the poses 'cam-to-pelvis-vol' are inverted"},
                             Other{{false, false, true}, "the marks 'gt-landmarks' are taken as (row, column)"}}) {
    const double left_px = read(file, specimen, other.reading).median_px();
    if (left_px <= most_px) return "they lie " + pixels_text(left_px) + " apart if " + other.change;
  }
  for (const auto& sentence : calibration::explanations(as_is.cameras, as_is.points))
    if (sentence) return *sentence;
  return "";
}

Metrics deepfluoro(const Options& options, Context& context) {
  const DeepfluoroFile file(options.path);
  Metrics metrics;
  std::string faults;
  const std::vector<std::string> specimens = file.specimens();
  for (std::size_t i = 0; i < specimens.size(); ++i) {
    context.check_cancelled();
    context.progress(double(i) / double(specimens.size()), specimens[i]);
    const std::string& specimen = specimens[i];
    const Read as_is = read(file, specimen, {});
    if (as_is.off_px.empty())
      throw Error("specimen " + specimen + ": no landmark of the CT is marked in an image, so nothing can be checked");
    metrics.items.push_back({specimen + ".images", double(as_is.cameras.size()), ""});
    metrics.items.push_back({specimen + ".landmarks", double(as_is.off_px.size()), ""});
    metrics.items.push_back({specimen + ".median", as_is.median_px(), "px"});
    metrics.items.push_back({specimen + ".worst", as_is.off_px.back(), "px"});
    const std::string found = formatted("specimen {}: {} in {} lie {} (median) from where the file marks them",
                                        specimen, counted(as_is.off_px.size(), "landmark"),
                                        counted(as_is.cameras.size(), "image"), pixels_text(as_is.median_px()));
    if (as_is.median_px() <= options.most_px) {
      context.info(found + ": all signs fit");
      continue;
    }
    const std::string change = remedy(file, specimen, as_is, options.most_px);
    faults += (faults.empty() ? "" : "\n") + found + "; " +
              (change.empty() ? "no single change of a sign explains this: is it the file of this data set?" : change);
  }
  if (!faults.empty()) throw Error(faults);
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.deepfluoro", deepfluoro)
      .summary(
          "Projects the landmarks of each CT of a DeepFluoro file with the cameras of its images, and says whether all "
          "signs fit; if not, what would make them fit")
      .out("metrics", "for each specimen: images, landmarks, and their distances from where the file marks them")
      .figures({"*.images", "*.landmarks", "*.median", "*.worst"})
      .option("path", &Options::path, "the HDF5 file of full resolution", required())
      .option("most_px", &Options::most_px, "largest median distance that counts as a fit", at_least(0), unit("px"));
}
