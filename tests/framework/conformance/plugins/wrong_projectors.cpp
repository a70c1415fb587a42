// SPDX-License-Identifier: Apache-2.0
#include "wrong.hpp"

namespace {

using marrow::Camera;
using marrow::OutlinePoint;
using marrow::OutlineProjector;
using marrow::PixelGrid;
using marrow::RadiographProjector;
using marrow::RigidTransform;

template <wrong::Fault fault>
class Outline : public OutlineProjector {
 public:
  explicit Outline(std::shared_ptr<const OutlineProjector> right) : right_(std::move(right)) {}
  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& pose,
                                    double spacing_px) const override {
    if (fault == "silent") throw marrow::Error("no");
    std::vector<OutlinePoint> points = right_->outline(camera, pose, spacing_px);
    if (fault == "gaps") std::erase_if(points, [](const OutlinePoint& point) { return point.u_px < 70; });
    for (OutlinePoint& point : points) {
      const float u = point.normal_u, v = point.normal_v;
      if (fault == "inward") point.normal_u = -u, point.normal_v = -v;
      if (fault == "slanted") point.normal_u = 0.9f * u - 0.436f * v, point.normal_v = 0.436f * u + 0.9f * v;
      if (fault == "shifted_outline") point.u_px = std::min(point.u_px + 1.5f, float(camera.width_px - 1));
    }
    return points;
  }

 private:
  std::shared_ptr<const OutlineProjector> right_;
};

template <wrong::Fault fault>
class Radiograph : public RadiographProjector {
 public:
  explicit Radiograph(std::shared_ptr<const RadiographProjector> right) : right_(std::move(right)) {}
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& pose,
                                const PixelGrid& grid) const override {
    PixelGrid read = grid;
    if (fault == "coarse") read.step_px = 1;
    if (fault == "shifted_radiograph") read.u_px += 1.5;
    return changed(camera, pose, read);
  }
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& pose,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    std::vector<Eigen::Vector2f> read = pixels;
    if (fault == "shifted_radiograph")
      for (Eigen::Vector2f& pixel : read) pixel.x() += 1.5f;
    return changed(camera, pose, read);
  }
  PixelGrid region(const Camera& camera, const RigidTransform& pose) const override {
    return fault == "narrow" ? PixelGrid{60, 60, 1, 40, 40} : right_->region(camera, pose);
  }

 private:
  template <class Pixels>
  std::vector<float> changed(const Camera& camera, const RigidTransform& pose, const Pixels& pixels) const {
    std::vector<float> values = right_->radiograph(camera, pose, pixels);
    if (fault == "dense" || fault == "changing")
      for (float& value : values) value *= fault == "dense" ? 1.05f : 1 + 0.001f * float(wrong::next_call() % 7);
    if (fault == "behind") {  // what lies behind the source, mirrored
      Camera back = camera;
      back.camera_from_world.rotation.bottomRows<2>() *= -1;
      back.camera_from_world.translation_mm.tail<2>() *= -1;
      const std::vector<float> more = right_->radiograph(back, pose, pixels);
      for (std::size_t i = 0; i < values.size(); ++i) values[i] += more[i];
    }
    return values;
  }

  std::shared_ptr<const RadiographProjector> right_;
};

template <wrong::Fault fault>
std::shared_ptr<const OutlineProjector> outline(const marrow::Mesh& mesh) {
  return std::make_shared<Outline<fault>>(wrong::right_function<OutlineProjector>(
      "project.silhouette_edges", "projector", {{"model", marrow::node_test::item(mesh)}}));
}

template <wrong::Fault fault>
std::shared_ptr<const RadiographProjector> radiograph(const marrow::Volume& volume, const marrow::SignedField* field) {
  marrow::node_test::Inputs inputs{{"volume", marrow::node_test::item(volume)}};
  if (field && !(fault == "everything")) inputs["field"] = marrow::node_test::item(*field);
  return std::make_shared<Radiograph<fault>>(
      wrong::right_function<RadiographProjector>("project.siddon_jacobs", "projector", inputs));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain_outline", "shifted_outline", "silent", "inward", "gaps", "slanted">(
      plugin, "project", []<wrong::Fault fault>() { return &outline<fault>; },
      [](auto&& node) { node.in("model", "surface").out("projector", "draws the outline"); });
  wrong::declare<"plain_radiograph", "shifted_radiograph", "dense", "narrow", "behind", "coarse", "everything",
                 "changing">(
      plugin, "project", []<wrong::Fault fault>() { return &radiograph<fault>; },
      [](auto&& node) { node.in("volume", "CT").in("field", "fragment").out("projector", "makes radiographs"); });
}
