// SPDX-License-Identifier: Apache-2.0
// What a report shows in 3D (the interactive display of the chapter's Fig. 8): the models where the registration put
// them, where it began and where they are in truth, to be looked at through each view's camera over its image.
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
      .summary("Models, poses and views for the 3D view of a report")
      .in("meshes", "surfaces to draw, simplified ones where they are large", marrow::over("fragment"))
      .in("poses", "where the registration put them", marrow::over("fragment"))
      .in("views", "X-ray views", marrow::over("view"))
      .in("starts", "where the registration began", marrow::over("fragment"))
      .in("truths", "where they are, for simulated data", marrow::over("fragment"))
      .out("scene", "what `marrow show` and comparisons show")
      .option("size_px", &Options::size_px, "longer side of the views' images at most", marrow::at_least(64),
              marrow::at_most(4096))
      .option("contrast", &Options::contrast, "how grey values become brightness",
              marrow::one_of({"linear", "logarithmic", "local"}));
}
