// SPDX-License-Identifier: Apache-2.0
// Two plain projectors, one that adds a volume's attenuation at even steps and one that draws the edges of a mesh
// between what faces the source and what does not, and others that are wrong in one way each: the suite must catch each
// of them.
#include <atomic>
#include <cmath>
#include <map>
#include <marrow/plugin.hpp>

namespace {

enum class Fault { none, shifted, dense, narrow, behind, silent, coarse, everything, changing, inward, gaps, slanted };

template <Fault fault>
class PlainOutline : public marrow::OutlineProjector {
 public:
  explicit PlainOutline(const marrow::Mesh& mesh) : mesh_(mesh) { marrow::check_mesh(mesh, "the mesh"); }

  std::vector<marrow::OutlinePoint> outline(const marrow::Camera& camera, const marrow::RigidTransform& pose,
                                            double spacing_px) const override {
    if constexpr (fault == Fault::silent) throw marrow::Error("no");
    const marrow::RigidTransform camera_from_model = camera.camera_from_world * pose;
    const Eigen::Vector3d source = inverse(camera_from_model).translation_mm;
    const auto normal_of = [&](std::size_t t) {
      const auto& [a, b, c] = mesh_.triangles[t];
      return Eigen::Vector3d((mesh_.vertices_mm[b] - mesh_.vertices_mm[a])
                                 .cross(mesh_.vertices_mm[c] - mesh_.vertices_mm[a])
                                 .normalized());
    };
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<bool, Eigen::Vector3d>> open;
    std::vector<marrow::OutlinePoint> points;
    double passed = 0;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Eigen::Vector3d normal = normal_of(t);
      const bool front = normal.dot(source - mesh_.vertices_mm[mesh_.triangles[t][0]]) > 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto a = mesh_.triangles[t][k], b = mesh_.triangles[t][(k + 1) % 3];
        const auto [at, added] = open.try_emplace({std::min(a, b), std::max(a, b)}, front, normal);
        if (added || at->second.first == front) continue;
        passed += add(camera, pose, camera_from_model, a, b, normal + at->second.second, spacing_px, passed, points);
        passed = std::fmod(passed, spacing_px);
      }
    }
    return points;
  }

 private:
  /// One point for each spacing_px of outline; gives the length of this piece.
  double add(const marrow::Camera& camera, const marrow::RigidTransform& pose,
             const marrow::RigidTransform& camera_from_model, std::uint32_t a, std::uint32_t b,
             const Eigen::Vector3d& normal, double spacing_px, double passed,
             std::vector<marrow::OutlinePoint>& points) const {
    const Eigen::Vector3d middle = 0.5 * (mesh_.vertices_mm[a] + mesh_.vertices_mm[b]);
    const Eigen::Vector2d from = project(camera, pose * mesh_.vertices_mm[a]),
                          to = project(camera, pose * mesh_.vertices_mm[b]), pixel = 0.5 * (from + to);
    if (!pixel.allFinite()) return 0;
    const bool is_out =
        pixel.x() < 0 || pixel.y() < 0 || pixel.x() > camera.width_px - 1 || pixel.y() > camera.height_px - 1;
    const double length = (to - from).norm();
    if (is_out || passed + length < spacing_px || (fault == Fault::gaps && pixel.x() < 70)) return is_out ? 0 : length;
    Eigen::Vector2d n =
        (camera.intrinsics.inverse().transpose() * (camera_from_model.rotation * normal)).head<2>().normalized();
    if (fault == Fault::inward) n = -n;
    if (fault == Fault::slanted) n = Eigen::Vector2d(0.9 * n.x() - 0.436 * n.y(), 0.436 * n.x() + 0.9 * n.y());
    const double off = fault == Fault::shifted ? 1.5 : 0;
    points.push_back({float(std::min(pixel.x() + off, camera.width_px - 1.0)), float(pixel.y()), float(n.x()),
                      float(n.y()), middle.cast<float>()});
    return length;
  }

  const marrow::Mesh& mesh_;
};

template <Fault fault>
class PlainRadiograph : public marrow::RadiographProjector {
 public:
  PlainRadiograph(const marrow::Volume& volume, const marrow::SignedField* field)
      : volume_(volume), field_(fault == Fault::everything ? nullptr : field) {
    marrow::check_volume(volume, "the volume");
    if (field && (field->grid.size != volume.grid.size || field->values_mm.size() != volume.values.size()))
      throw marrow::Error("the field has another size than the volume");
  }

  std::vector<float> radiograph(const marrow::Camera& camera, const marrow::RigidTransform& pose,
                                const marrow::PixelGrid& grid) const override {
    std::vector<float> values;
    const double step = fault == Fault::coarse ? 1 : grid.step_px;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column)
        values.push_back(integral(camera, pose, grid.u_px + step * column, grid.v_px + step * row));
    return values;
  }
  std::vector<float> radiograph(const marrow::Camera& camera, const marrow::RigidTransform& pose,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    std::vector<float> values;
    for (const auto& p : pixels) values.push_back(integral(camera, pose, double(p.x()), double(p.y())));
    return values;
  }
  marrow::PixelGrid region(const marrow::Camera& camera, const marrow::RigidTransform&) const override {
    marrow::check_camera(camera, "the camera");
    if (fault == Fault::narrow) return {60, 60, 1, 40, 40};
    return {0, 0, 1, camera.width_px, camera.height_px};
  }

 private:
  float integral(const marrow::Camera& camera, const marrow::RigidTransform& pose, double u, double v) const {
    static std::atomic<int> calls{0};
    constexpr double kStep_mm = 0.8, kReach_mm = 48;
    marrow::check_camera(camera, "the camera");
    const marrow::RigidTransform model_from_world = inverse(pose);
    const Eigen::Vector3d source = model_from_world * source_position_mm(camera),
                          middle = volume_.grid.point_from_index(
                              0.5 * Eigen::Vector3d(volume_.grid.size[0], volume_.grid.size[1], volume_.grid.size[2]));
    const Eigen::Vector3d along =
        model_from_world.rotation * ray_direction(camera, {u + (fault == Fault::shifted ? 1.5 : 0), v});
    const double nearest = (middle - source).dot(along);
    double sum = 0;
    for (double t = nearest - kReach_mm; t < nearest + kReach_mm; t += kStep_mm) {
      if (t < 0 && fault != Fault::behind) continue;
      const Eigen::Vector3d index = volume_.grid.index_from_point(source + t * along);
      bool is_in = true;
      for (int k = 0; k < 3; ++k)
        is_in = is_in && index[k] >= -0.5 && index[k] <= volume_.grid.size[std::size_t(k)] - 0.5;
      if (!is_in || (field_ && sample_trilinear(field_->grid, field_->values_mm, index) > 1)) continue;
      sum += kStep_mm * (double(sample_trilinear(volume_.grid, volume_.values, index)) + 1000) / 1000;
    }
    if (fault == Fault::dense) sum *= 1.05;
    if (fault == Fault::changing && ++calls % 7 == 0) sum *= 1.001;
    return float(std::max(0.0, sum));
  }

  const marrow::Volume& volume_;
  const marrow::SignedField* field_;
};

template <Fault fault>
std::shared_ptr<const marrow::OutlineProjector> outline(const marrow::Mesh& mesh) {
  return std::make_shared<PlainOutline<fault>>(mesh);
}

template <Fault fault>
std::shared_ptr<const marrow::RadiographProjector> radiograph(const marrow::Volume& volume,
                                                              const marrow::SignedField* field) {
  return std::make_shared<PlainRadiograph<fault>>(volume, field);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add_outline = [&](const char* name, auto* function) {
    plugin.node(name, function)
        .summary("For a test of the suite")
        .in("model", "surface")
        .out("projector", "draws the outline");
  };
  add_outline("project.plain_outline", outline<Fault::none>);
  add_outline("project.shifted_outline", outline<Fault::shifted>);
  add_outline("project.silent", outline<Fault::silent>);
  add_outline("project.inward", outline<Fault::inward>);
  add_outline("project.gaps", outline<Fault::gaps>);
  add_outline("project.slanted", outline<Fault::slanted>);

  const auto add_radiograph = [&](const char* name, auto* function) {
    plugin.node(name, function)
        .summary("For a test of the suite")
        .in("volume", "CT")
        .in("field", "fragment")
        .out("projector", "makes radiographs");
  };
  add_radiograph("project.plain_radiograph", radiograph<Fault::none>);
  add_radiograph("project.shifted_radiograph", radiograph<Fault::shifted>);
  add_radiograph("project.dense", radiograph<Fault::dense>);
  add_radiograph("project.narrow", radiograph<Fault::narrow>);
  add_radiograph("project.behind", radiograph<Fault::behind>);
  add_radiograph("project.coarse", radiograph<Fault::coarse>);
  add_radiograph("project.everything", radiograph<Fault::everything>);
  add_radiograph("project.changing", radiograph<Fault::changing>);
}
