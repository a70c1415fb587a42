// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include "marrow/base/number_text.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

Eigen::Vector3d point_of(const py::handle& object, const std::string& what) {
  return Eigen::Vector3d(numbers_of(object, {3}, what).data());
}

std::vector<Eigen::Vector3d> points_of(const py::handle& object, const std::string& what) {
  const std::vector<double> numbers = numbers_of(object, {-1, 3}, what);
  std::vector<Eigen::Vector3d> points(numbers.size() / 3);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = Eigen::Vector3d(numbers.data() + 3 * i);
  return points;
}

py::object array_of_points(const std::shared_ptr<const void>& owner, const std::vector<Eigen::Vector3d>& points) {
  return array_of(owner, buffer_of(reinterpret_cast<const double*>(points.data()), {py::ssize_t(points.size()), 3}));
}

/// "world_from_ct, translation (1, 2, 3) mm".
std::string mapping_text(const RigidTransform& transform) {
  const Eigen::Vector3d& at = transform.translation_mm;
  return formatted("{}_from_{}, translation ({}, {}, {}) mm", transform.target, transform.source,
                   short_number(at[0], 6), short_number(at[1], 6), short_number(at[2], 6));
}

/// Points [..., xyz] of the source, in the target. Throws Error if the last axis has not three numbers.
py::object mapped_points(const RigidTransform& transform, const py::object& points) {
  const py::object array = array_of_real(points, "float64", "points");
  const auto shape = array.attr("shape").cast<py::tuple>();
  if (shape.empty() || shape[shape.size() - 1].cast<int>() != 3)
    throw Error("points: expected an array [..., 3] of x, y, z in mm, got the shape " +
                py::repr(shape).cast<std::string>());
  const py::object rotated = array.attr("__matmul__")(array_of(Eigen::MatrixXd(transform.rotation.transpose())));
  return rotated.attr("__add__")(array_of(Eigen::MatrixXd(transform.translation_mm.transpose())).attr("ravel")());
}

void bind_transform(py::module_& module) {
  py::class_<RigidTransform>(module, "Transform", "A rigid transform that knows the frames from and to which it maps.")
      .def(py::init([](const py::object& matrix, const std::string& target, const std::string& source) {
             return transform_of(matrix, target, source, "Transform");
           }),
           py::arg("matrix"), py::kw_only(), py::arg("target") = "world", py::arg("source") = "ct",
           "A rigid 4 x 4 matrix that maps points of the source, in mm, to the target.")
      .def_property_readonly(
          "matrix", [](const RigidTransform& self) { return array_of(self); }, "The 4 x 4 matrix, in mm.")
      .def_readonly("target", &RigidTransform::target, "The frame to which it maps.")
      .def_readonly("source", &RigidTransform::source, "The frame from which it maps.")
      .def(
          "inverse", [](const RigidTransform& self) { return inverse(self); }, "From the target to the source.")
      .def(
          "__matmul__", [](const RigidTransform& self, const RigidTransform& first) { return self * first; },
          py::is_operator(), "First the other transform, then this one. Their frames must fit.")
      .def("__matmul__", &mapped_points, "Points [..., xyz] of the source, in mm, as they lie in the target.")
      .def("__repr__", [](const RigidTransform& self) { return "<marrow.Transform " + mapping_text(self) + ">"; })
      .def("__copy__", [](const py::object& self) { return self; })
      .def("__deepcopy__", [](const py::object& self, const py::object&) { return self; })
      .def(py::pickle(
          [](const RigidTransform& self) { return py::make_tuple(array_of(self), self.target, self.source); },
          [](const py::tuple& state) {
            return transform_of(state[0], state[1].cast<std::string>(), state[2].cast<std::string>(), "Transform");
          }));
}

void bind_mesh(py::module_& module) {
  value_class<Mesh>(module, "Mesh", "A surface of triangles, counter-clockwise as seen from outside.")
      .def(py::init([](const py::object& vertices_mm, const py::object& triangles, const std::string& frame) {
             auto mesh = std::make_shared<Mesh>();
             mesh->vertices_mm = points_of(vertices_mm, "vertices_mm");
             const std::vector<double> corners = numbers_of(triangles, {-1, 3}, "triangles");
             for (const double corner : corners)
               if (corner != double(std::uint32_t(corner)))
                 throw Error(formatted("triangles: expected indices of vertices, got {:f}", corner));
             for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
               mesh->triangles.push_back(
                   {std::uint32_t(corners[i]), std::uint32_t(corners[i + 1]), std::uint32_t(corners[i + 2])});
             mesh->frame = frame;
             check_mesh(*mesh, "Mesh");
             return mesh;
           }),
           py::arg("vertices_mm"), py::arg("triangles"), py::kw_only(), py::arg("frame") = "ct",
           "Copies arrays [vertex, xyz] and [triangle, corner].")
      .def_property_readonly(
          "vertices_mm", [](const std::shared_ptr<Mesh>& self) { return array_of_points(self, self->vertices_mm); },
          "The vertices as a read-only numpy array [vertex, xyz], without a copy.")
      .def_property_readonly(
          "triangles",
          [](const std::shared_ptr<Mesh>& self) {
            return array_of(self, buffer_of(reinterpret_cast<const std::uint32_t*>(self->triangles.data()),
                                            {py::ssize_t(self->triangles.size()), 3}));
          },
          "The triangles as a read-only numpy array [triangle, corner] of indices of vertices, without a copy.")
      .def_property_readonly(
          "frame", [](const Mesh& self) { return self.frame; }, "The name of the frame.")
      .def("__repr__", [](const Mesh& self) {
        return formatted("<marrow.Mesh of {} vertices, {} triangles, mm, frame '{}'>", self.vertices_mm.size(),
                         self.triangles.size(), self.frame);
      });
}

void bind_views(py::module_& module) {
  value_class<Camera>(module, "Camera", "The pinhole model of an X-ray view, in OpenCV's convention.")
      .def(py::init([](int width_px, int height_px, const py::object& intrinsics, const py::object& camera_from_world) {
             auto camera = std::make_shared<Camera>();
             camera->width_px = width_px;
             camera->height_px = height_px;
             camera->intrinsics = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
                 numbers_of(intrinsics, {3, 3}, "intrinsics").data());
             camera->camera_from_world = transform_of(camera_from_world, "camera", "world", "camera_from_world");
             check_camera(*camera, "Camera");
             return camera;
           }),
           py::arg("width_px"), py::arg("height_px"), py::arg("intrinsics"), py::arg("camera_from_world"),
           "intrinsics: 3 x 3; camera_from_world: 4 x 4, in mm.")
      .def_readonly("width_px", &Camera::width_px, "The number of columns of its images.")
      .def_readonly("height_px", &Camera::height_px, "The number of rows of its images.")
      .def_property_readonly(
          "intrinsics", [](const Camera& self) { return array_of(Eigen::MatrixXd(self.intrinsics)); },
          "The camera matrix, 3 x 3.")
      .def_property_readonly(
          "camera_from_world", [](const Camera& self) { return array_of(self.camera_from_world); },
          "The transform from the world to the camera, 4 x 4, in mm.")
      .def("__repr__", [](const Camera& self) {
        return formatted("<marrow.Camera {} x {} px, focal length {} px>", self.width_px, self.height_px,
                         short_number(self.intrinsics(0, 0), 6));
      });
  value_class<View>(module, "View", "An X-ray image with its camera.")
      .def(
          py::init([](const py::object& image, const std::shared_ptr<Camera>& camera, const py::object& mask,
                      const std::string& name) {
            auto view = std::make_shared<View>();
            view->name = name;
            view->image = py::isinstance<Image>(image) ? image.cast<const Image&>()
                                                       : Image{pixels_of(image, "image of the view")};
            view->camera = *camera;
            if (!mask.is_none()) view->mask = pixels_of(mask, "mask of the view");
            check_view(*view);
            return view;
          }),
          py::arg("image"), py::arg("camera"), py::kw_only(), py::arg("mask") = py::none(), py::arg("name") = "view",
          "image: a marrow.Image or an array [row, column], which is copied. mask: an array of bool or uint8, not zero "
          "where the image may be used.")
      .def_property_readonly(
          "name", [](const View& self) { return self.name; }, "The name, as \"lateral\".")
      .def_property_readonly(
          "image", [](const std::shared_ptr<View>& self) { return std::shared_ptr<Image>(self, &self->image); },
          "The image.")
      .def_property_readonly(
          "camera", [](const std::shared_ptr<View>& self) { return std::shared_ptr<Camera>(self, &self->camera); },
          "The camera.")
      .def_property_readonly(
          "mask",
          [](const std::shared_ptr<View>& self) -> py::object {
            return self->mask.empty() ? py::none() : array_of(self, buffer_of(self->mask));
          },
          "Where the image may be used: an array of uint8, or None for everywhere.")
      .def("__repr__", [](const View& self) {
        return "<marrow.View " + self.name + ", " + text_of(self.image) + (self.mask.empty() ? "" : ", masked") + ">";
      });
}

void bind_poses(py::module_& module) {
  value_class<Pose>(module, "Pose", "Where a fragment is.")
      .def(py::init(
               [](const py::object& matrix, const std::string& target, const std::string& source, const Pose* axes_of) {
                 auto pose = std::make_shared<Pose>();
                 pose->world_from_model = transform_of(matrix, target, source, "Pose");
                 if (axes_of) pose->frame = axes_of->frame;
                 return pose;
               }),
           py::arg("matrix"), py::kw_only(), py::arg("target") = "world", py::arg("source") = "ct",
           py::arg("axes_of") = py::none(),
           "A rigid 4 x 4 matrix that maps points of the model, in mm, to the world. axes_of: another pose of the same "
           "model, whose axes and origin it gets; without it, it has none of the bone.")
      .def_property_readonly(
          "matrix", [](const Pose& self) { return array_of(self.world_from_model); },
          "The 4 x 4 matrix that maps points of the model, in mm, to the world.")
      .def_property_readonly(
          "transform", [](const Pose& self) { return self.world_from_model; }, "The same, with its frames.")
      .def_property_readonly(
          "target", [](const Pose& self) { return self.world_from_model.target; }, "The frame to which it maps.")
      .def_property_readonly(
          "source", [](const Pose& self) { return self.world_from_model.source; }, "The frame from which it maps.")
      .def_property_readonly(
          "covariance",
          [](const Pose& self) -> py::object {
            return self.covariance ? array_of(Eigen::MatrixXd(*self.covariance)) : py::none();
          },
          "The predicted covariance, 6 x 6, of rotations (rad) about and translations (mm) along the axes of the "
          "fragment; None if it was not predicted.")
      .def_property_readonly(
          "axes", [](const Pose& self) { return array_of(Eigen::MatrixXd(self.frame.axes)); },
          "The frontal, lateral and long axis of the fragment, in the frame of the model: columns.")
      .def_property_readonly(
          "origin_mm",
          [](const Pose& self) { return array_of(Eigen::MatrixXd(self.frame.origin_mm.transpose())).attr("ravel")(); },
          "The centre of the fragment, in the frame of the model.")
      .def_readonly("warnings", &Pose::warnings, "Warnings in words.")
      .def_readonly("cost", &Pose::cost, "The cost at the pose.")
      .def_readonly("evaluations", &Pose::evaluations, "How often the cost was computed.")
      .def_property_readonly(
          "convergence",
          [](const Pose& self) {
            py::list steps;
            for (const Pose::Progress& one : self.convergence) steps.append(py::make_tuple(one.evaluations, one.cost));
            return steps;
          },
          "Pairs: after so many evaluations, the least cost so far.")
      .def("__repr__", [](const Pose& self) { return "<marrow.Pose " + mapping_text(self.world_from_model) + ">"; });
  value_class<Truth>(module, "Truth", "The exact pose of a fragment, known for simulated data.")
      .def_property_readonly(
          "matrix", [](const Truth& self) { return array_of(self.world_from_model); },
          "The 4 x 4 matrix that maps points of the model, in mm, to the world.")
      .def_property_readonly(
          "transform", [](const Truth& self) { return self.world_from_model; }, "The same, with its frames.")
      .def("__repr__", [](const Truth& self) { return "<marrow.Truth " + mapping_text(self.world_from_model) + ">"; });
}

/// (u, v) or (u, v, deviation) as a landmark that a view shows.
Landmarks::Seen seen_of(const std::string& name, const std::string& view, const py::handle& pixel) {
  const bool has_deviation = py::isinstance<py::sequence>(pixel) && py::len(pixel) == 3;
  const std::vector<double> numbers = numbers_of(pixel, {has_deviation ? 3 : 2}, "landmark as seen");
  if (has_deviation && !(numbers[2] >= 0))
    throw Error(formatted("landmark '{}' as seen: its deviation must be positive, or 0 if it is not known; got {}",
                          name, numbers[2]));
  return {name, view, {numbers[0], numbers[1]}, has_deviation ? numbers[2] : 0};
}

}  // namespace

void bind_geometry(py::module_& module) {
  bind_transform(module);
  bind_mesh(module);
  bind_views(module);
  bind_poses(module);
  value_class<Seeds>(module, "Seeds", "Points inside one fragment, from which a segmenter grows it.")
      .def(py::init([](const std::string& fragment, const py::object& points_mm, bool wanted) {
             return std::make_shared<Seeds>(Seeds{fragment, points_of(points_mm, "points_mm"), wanted});
           }),
           py::arg("fragment"), py::arg("points_mm"), py::kw_only(), py::arg("wanted") = true)
      .def_readonly("fragment", &Seeds::fragment, "The name of the fragment.")
      .def_readonly("wanted", &Seeds::wanted, "False for a fragment that is only to be kept apart from the others.")
      .def_property_readonly(
          "points_mm", [](const std::shared_ptr<Seeds>& self) { return array_of_points(self, self->points_mm); },
          "The points as a read-only numpy array [point, xyz], without a copy.")
      .def("__repr__", [](const Seeds& self) {
        return formatted("<marrow.Seeds of {}: {}, mm>", self.fragment, counted(self.points_mm.size(), "point"));
      });
  value_class<Landmarks>(module, "Landmarks", "Named points of one fragment, and where they were seen.")
      .def(py::init([](const py::dict& points_mm, const py::dict& seen_px) {
             auto made = std::make_shared<Landmarks>();
             for (const auto& [name, point] : points_mm)
               made->points.push_back({py::str(name), point_of(point, "landmark " + std::string(py::str(name)))});
             for (const auto& [view, points] : seen_px)
               for (const auto& [name, pixel] : py::reinterpret_borrow<py::dict>(points))
                 made->seen.push_back(seen_of(py::str(name), py::str(view), pixel));
             return made;
           }),
           py::arg("points_mm"), py::arg("seen_px") = py::dict(),
           "points_mm: {name: (x, y, z)}; seen_px: {view: {name: (u, v) or (u, v, deviation)}}.")
      .def_property_readonly(
          "points_mm",
          [](const Landmarks& self) {
            py::dict points;
            for (const Landmarks::Point& one : self.points)
              points[py::str(one.name)] = array_of(Eigen::MatrixXd(one.model_mm.transpose())).attr("ravel")();
            return points;
          },
          "The points of the model, by name.")
      .def_property_readonly(
          "seen_px",
          [](const Landmarks& self) {
            py::dict views;
            for (const Landmarks::Seen& one : self.seen) {
              const py::str view(one.view);
              if (!views.contains(view)) views[view] = py::dict();
              const Eigen::Vector3d numbers(one.pixel.x(), one.pixel.y(), one.deviation_px);
              views[view][py::str(one.name)] = array_of(Eigen::MatrixXd(numbers.transpose())).attr("ravel")();
            }
            return views;
          },
          "{view: {name: (u, v, deviation)}}: where views show the points; a deviation of 0 is not known.")
      .def("__repr__", [](const Landmarks& self) {
        return formatted("<marrow.Landmarks of {}, mm; seen {} times>", counted(self.points.size(), "point"),
                         self.seen.size());
      });
  value_class<Scene>(module, "Scene", "Models in their poses, and the views that show them.")
      .def_property_readonly(
          "models",
          [](const std::shared_ptr<Scene>& self) {
            py::dict models;
            for (const Scene::Model& one : self->models)
              models[py::str(one.name)] = std::shared_ptr<Mesh>(self, const_cast<Mesh*>(&one.mesh));
            return models;
          },
          "The surfaces, by name.")
      .def_property_readonly(
          "placements",
          [](const Scene& self) {
            py::list placements;
            for (const Scene::Placement& one : self.placements)
              placements.append(py::make_tuple(one.model, one.name, array_of(one.world_from_model)));
            return placements;
          },
          "Triples: the model, the name of the pose (\"result\", \"start\" or \"truth\"), and its 4 x 4 matrix.")
      .def("__repr__", [](const Scene& self) {
        return formatted("<marrow.Scene of {}, {}, {}>", counted(self.models.size(), "model"),
                         counted(self.placements.size(), "placement"), counted(self.views.size(), "view"));
      });
}

}  // namespace marrow::python
