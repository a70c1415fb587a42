// SPDX-License-Identifier: Apache-2.0
#include "checks.hpp"

namespace marrow::conformance {
namespace {

constexpr double kSpacing_px = 1;

/// Dense points of the true silhouette.
std::vector<OutlinePoint> true_outline(const Camera& camera) {
  return analytic::BodyProjector(egg()).outline(camera, pose(), 0.05);
}
const OutlinePoint& nearest(const std::vector<OutlinePoint>& points, const OutlinePoint& p) {
  return *std::min_element(points.begin(), points.end(), [&](const OutlinePoint& a, const OutlinePoint& b) {
    return std::hypot(a.u_px - p.u_px, a.v_px - p.v_px) < std::hypot(b.u_px - p.u_px, b.v_px - p.v_px);
  });
}

/// Errors of the outline in all views against the true silhouette: mean and largest distance, mean angle of the
/// normals, the part of the silhouette without a point near it, and the mean error of the surface points.
struct OutlineErrors {
  double mean_px = 0, worst_px = 0, angle_deg = 0, missing_percent = 0, model_mm = 0;
};
OutlineErrors outline_errors(const OutlineProjector& projector) {
  OutlineErrors errors;
  double count = 0, missing = 0, all = 0;
  for (const double angle : angles()) {
    const Camera camera = camera_at(angle);
    const std::vector<OutlinePoint> points = projector.outline(camera, pose(), kSpacing_px),
                                    silhouette = true_outline(camera);
    expect(!points.empty(), "its outline is empty");
    check_outline(points, camera);
    for (const OutlinePoint& p : points) {
      const OutlinePoint& q = nearest(silhouette, p);
      const double off = std::abs(double((p.u_px - q.u_px) * q.normal_u + (p.v_px - q.v_px) * q.normal_v));
      errors.mean_px += off;
      errors.worst_px = std::max(errors.worst_px, off);
      errors.angle_deg +=
          degrees(std::acos(std::clamp(double(p.normal_u * q.normal_u + p.normal_v * q.normal_v), -1.0, 1.0)));
      const Eigen::Vector2d seen = project(camera, pose() * p.model_mm.cast<double>());
      errors.model_mm += 0.6 * std::hypot(seen.x() - double(p.u_px), seen.y() - double(p.v_px));
      count += 1;
    }
    for (const OutlinePoint& q : silhouette) {
      const OutlinePoint& p = nearest(points, q);
      missing += std::hypot(p.u_px - q.u_px, p.v_px - q.v_px) > 2.5 * kSpacing_px;
      all += 1;
    }
  }
  errors.mean_px /= count;
  errors.angle_deg /= count;
  errors.model_mm /= count;
  errors.missing_percent = 100 * missing / all;
  return errors;
}

double largest(const Subject& subject, const std::function<double(const OutlineProjector&)>& figure) {
  return largest_of<OutlineProjector>(subject, inputs_of(egg()), "it draws no outlines", figure);
}

/// Four times the spacing should give a quarter of the points.
double spacing_off_percent(const OutlineProjector& projector) {
  const double fine = double(projector.outline(camera_at(0), pose(), 1).size()),
               coarse = double(projector.outline(camera_at(0), pose(), 4).size());
  return 100 * std::abs(4 * coarse / fine - 1);
}

/// Points drawn where the body is out of view or behind the source: there is nothing to see.
double points_out_of_view(const OutlineProjector& projector) {
  std::size_t most = 0;
  for (const Eigen::Vector3d& shift_mm :
       {Eigen::Vector3d(0, 0, 300), Eigen::Vector3d(0, -1200, 0), Eigen::Vector3d(0, -700, 0)}) {
    RigidTransform at = pose();
    at.translation_mm += shift_mm;
    most = std::max(most, projector.outline(camera_at(0), at, kSpacing_px).size());
  }
  return double(most);
}

/// A surface whose triangles face inwards may be refused, drawn as it should be, or not be drawn at all. Normals that
/// point to the bone would fit other borders in the image.
double points_facing_inwards(const Subject& subject) {
  const auto& ports = subject.info().inputs;
  if (std::none_of(ports.begin(), ports.end(), [](const PortInfo& one) { return one.name == "model"; }))
    throw NotApplicable("it draws no surface");
  Mesh mesh = mesh_of(egg());
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  const Inputs inputs = inputs_of(volume_of(egg(), fine_grid(), 500, -1000), field_of(egg(), fine_grid(), 6), mesh);
  if (subject.call(inputs).refusal) return 0;
  double inwards = 0;
  const Made made(subject, inputs);
  for (const OutlineProjector* projector : made.all<OutlineProjector>())
    for (const double angle : angles()) {
      const std::vector<OutlinePoint> silhouette = true_outline(camera_at(angle));
      for (const OutlinePoint& p : projector->outline(camera_at(angle), pose(), kSpacing_px)) {
        const OutlinePoint& q = nearest(silhouette, p);
        inwards += p.normal_u * q.normal_u + p.normal_v * q.normal_v < 0;
      }
    }
  return inwards;
}

}  // namespace

void check_outline(const std::vector<OutlinePoint>& points, const Camera& camera) {
  for (const OutlinePoint& p : points) {
    expect(std::isfinite(p.u_px) && std::isfinite(p.v_px) && p.model_mm.allFinite(),
           "a point of the outline is not a number");
    expect(p.u_px >= 0 && p.v_px >= 0 && p.u_px <= float(camera.width_px - 1) && p.v_px <= float(camera.height_px - 1),
           "a point of the outline lies outside of the image");
    expect(std::abs(std::hypot(p.normal_u, p.normal_v) - 1) < 1e-3f,
           "a normal of the outline is " + digits(double(std::hypot(p.normal_u, p.normal_v))) + " long, and not 1");
  }
}

std::vector<Check> outline_checks() {
  const auto error = [](const char* name, const char* what, double limit, const char* unit,
                        double OutlineErrors::*figure) {
    return Check{{name, what, limit, unit}, [figure](const Subject& subject) {
                   return largest(subject, [&](const OutlineProjector& one) { return outline_errors(one).*figure; });
                 }};
  };
  return {
      error("outline", "mean distance between the outline and an ellipsoid's silhouette", 0.35, "px",
            &OutlineErrors::mean_px),
      error("outline_worst", "largest distance between the outline and an ellipsoid's silhouette", 1.2, "px",
            &OutlineErrors::worst_px),
      error("outline_direction", "mean angle between the outline's normals and the silhouette's normals", 6, "deg",
            &OutlineErrors::angle_deg),
      error("outline_complete", "part of the silhouette that is more than 2.5 px from the outline", 0, "%",
            &OutlineErrors::missing_percent),
      error("outline_model",
            "mean distance, across the ray, between an outline point and the projection of its surface point", 1, "mm",
            &OutlineErrors::model_mm),
      {{"outline_spacing", "four times the spacing should give a quarter of the points: deviation of their number", 30,
        "%"},
       [](const Subject& subject) { return largest(subject, spacing_off_percent); }},
      {{"outline_out_of_view", "points of the outline if the body is out of view or behind the source", 0, "points"},
       [](const Subject& subject) { return largest(subject, points_out_of_view); }},
      {{"outline_inside_out", "points whose normal points to the bone if the surface's triangles face inwards", 0,
        "points"},
       points_facing_inwards}};
}

}  // namespace marrow::conformance
