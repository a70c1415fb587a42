// SPDX-License-Identifier: Apache-2.0
// The 3D view of a report (the interactive display of the chapter's Fig. 8). It shows the models at the poses found, at
// the start and at the true poses. They can be seen through the camera of each view, over its image.
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/toolbox/draw/canvas.hpp"

namespace {

using namespace marrow::draw;

struct Options {
  int size_px = 768;
  std::string contrast = "local";
};

template <class T>
void add(marrow::Scene& scene, const marrow::List<marrow::Mesh>& meshes, const marrow::List<T>* places,
         const std::string& name) {
  for (std::size_t i = 0; places && i < meshes.size(); ++i)
    if (const T* place = places->find(meshes.name(i))) {
      marrow::check_rigid(place->world_from_model, name + " of '" + meshes.name(i) + "'");
      scene.placements.push_back({meshes.name(i), name, place->world_from_model});
    }
}

marrow::Scene interactive(const marrow::List<marrow::Mesh>& meshes, const marrow::List<marrow::Pose>& poses,
                          const marrow::List<marrow::View>& views, const marrow::List<marrow::Pose>* starts,
                          const marrow::List<marrow::Truth>* truths, const Options& options) {
  marrow::Scene scene;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    marrow::check_mesh(meshes[i], "mesh of '" + meshes.name(i) + "'");
    scene.models.push_back({meshes.name(i), meshes[i]});
  }
  add(scene, meshes, &poses, "result");
  add(scene, meshes, starts, "start");
  add(scene, meshes, truths, "truth");
  if (scene.placements.empty()) throw marrow::Error("no mesh has a pose: the names of meshes and poses differ");
  for (std::size_t i = 0; i < views.size(); ++i) {
    marrow::check_view(views[i]);
    const int size_px = std::min(options.size_px, std::max(views[i].image.width(), views[i].image.height()));
    marrow::Picture picture;
    cv::cvtColor(make_panel(views[i], whole_image(views[i]), size_px, contrast_of(options.contrast)).pixels,
                 picture.pixels, cv::COLOR_RGB2GRAY);
    scene.views.push_back({views[i].name, views[i].camera, picture});
  }
  return scene;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("render.interactive", interactive)
      .summary("Collects models, poses and views for the 3D view of a report")
      .in("models", "surfaces to draw; simplify large ones first (mesh.simplify)", marrow::over("fragment"))
      .in("poses", "poses found", marrow::over("fragment"))
      .in("views", "X-ray views", marrow::over("view"))
      .in("starts", "poses at the start of the registration", marrow::over("fragment"))
      .in("truths", "exact poses, for simulated data", marrow::over("fragment"))
      .out("scene", "scene for `marrow show` and for the reports of comparisons")
      .option("size_px", &Options::size_px, "largest length of the longer side of the views' images",
              marrow::at_least(64), marrow::at_most(4096))
      .option("contrast", &Options::contrast, "how grey values are shown",
              marrow::one_of({"linear", "logarithmic", "local"}));
}
