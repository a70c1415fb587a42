// SPDX-License-Identifier: Apache-2.0
// A case made from nothing: written, it is a folder with a volume, a float image, a mask and text.
#include <marrow/plugin.hpp>

namespace {

struct Options {
  int seed = 1;
};

marrow::Case small_case(const Options& options) {
  marrow::Case result;
  result.ct.grid.size = {5, 4, 3};
  for (std::size_t i = 0; i < result.ct.grid.count(); ++i)
    result.ct.values.push_back(float(int(i) * 7 % 50 + options.seed));
  result.seeds.add("bone", {"bone", {{1, 1, 1}}, true});
  marrow::View view;
  view.name = "frontal";
  view.image.pixels = cv::Mat(6, 8, CV_32F, cv::Scalar(0.25));
  view.mask = cv::Mat(6, 8, CV_8U, cv::Scalar(255));
  view.camera.width_px = 8;
  view.camera.height_px = 6;
  result.views.add("frontal", view);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("faults.case", small_case)
      .summary("A small case")
      .out("case", "its volume, one view and one fragment")
      .option("seed", &Options::seed, "added to the volume", marrow::at_least(0));
}
