// SPDX-License-Identifier: Apache-2.0
#pragma once
// The interactive parts of reports: models in their poses together with the X-ray views, and the cost around a pose.
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/mesh.hpp"

namespace MARROW_EXPORT marrow {

/// Models in their poses, and the views that show them.
struct Scene {
  struct Model {
    std::string name;
    Mesh mesh;  ///< may be coarser than the mesh that was registered
    using fields = Fields<&Model::name, &Model::mesh>;
  };
  /// A pose of a model. `name` is "result", "start" or "truth".
  struct Placement {
    std::string model, name;
    RigidTransform world_from_model{"world", "ct"};
    using fields = Fields<&Placement::model, &Placement::name, &Placement::world_from_model>;
  };
  /// A view's camera, and its image for display: 8 bit, grey, of the camera's size.
  struct Backdrop {
    std::string name;
    Camera camera;
    Picture picture;
    using fields = Fields<&Backdrop::name, &Backdrop::camera, &Backdrop::picture>;
  };
  std::vector<Model> models;
  std::vector<Placement> placements;
  std::vector<Backdrop> views;
  using fields = Fields<&Scene::models, &Scene::placements, &Scene::views>;
};

/// The cost around a pose, along each of the six axes of the fragment (the chapter's Fig. 7b).
struct Landscape {
  struct Profile {
    std::string axis;  ///< "rotation about the frontal axis"
    std::string unit;  ///< unit of the offsets: "deg" or "mm"
    std::vector<double> offsets, costs;
    std::optional<double> truth;  ///< offset of the exact pose along this axis
    using fields = Fields<&Profile::axis, &Profile::unit, &Profile::offsets, &Profile::costs, &Profile::truth>;
  };
  std::vector<Profile> profiles;
  using fields = Fields<&Landscape::profiles>;
};

}  // namespace marrow
