// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/photograph.hpp"

#include <tbb/parallel_for.h>

#include <opencv2/imgproc.hpp>

#include "marrow/domain/random.hpp"
#include "marrow/simulate/solid.hpp"

namespace marrow::phantom {
namespace {

constexpr int kRaysAcross = 2;          // rays per pixel in each direction
constexpr int kRowsOfTask = 32;         // rows of rays followed by one task
constexpr double kNearest_mm = 10;      // no body may be nearer to the camera
constexpr double kShadowStep_mm = 0.6;  // between the rays of a lamp
constexpr double kShadowBias_mm = 1.2;  // a surface does not hide itself
constexpr double kShininess = 30;

struct Corner {
  Eigen::Vector3d at_mm, normal;
};
struct Facet {
  std::array<Corner, 3> corners;
  const Painted* body;
};

std::vector<Facet> facets_of(const std::vector<Painted>& bodies) {
  std::vector<Facet> facets;
  for (const Painted& body : bodies) {
    const auto& vertices = body.surface.vertices_mm;
    std::vector<Eigen::Vector3d> normals(vertices.size(), Eigen::Vector3d::Zero());
    const auto area_of = [&](const auto& t) {
      return Eigen::Vector3d((vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]));
    };
    for (const auto& t : body.surface.triangles)
      for (const std::uint32_t corner : t) normals[corner] += area_of(t);
    for (const auto& t : body.surface.triangles) {
      Facet facet;
      for (std::size_t k = 0; k < 3; ++k)
        facet.corners[k] = {vertices[t[k]], (body.smooth ? normals[t[k]] : area_of(t)).normalized()};
      facet.body = &body;
      facets.push_back(facet);
    }
  }
  return facets;
}

/// For each ray of a grid, the first facet that it meets and its depth; -1 where it meets none. The number of a facet
/// is that of its surface in the bundle.
struct FirstMet {
  cv::Mat1i facet;
  cv::Mat1d depth;
};

FirstMet first_met(const RayBundle& bundle) {
  FirstMet met{cv::Mat1i(bundle.rows(), bundle.columns(), -1),
               cv::Mat1d(bundle.rows(), bundle.columns(), std::numeric_limits<double>::infinity())};
  tbb::parallel_for(0, (bundle.rows() + kRowsOfTask - 1) / kRowsOfTask, [&](int band) {
    const auto crossings = bundle.crossings(band * kRowsOfTask, std::min(bundle.rows(), (band + 1) * kRowsOfTask));
    for_each_ray(crossings, [&](std::span<const Crossing> ray) {
      met.facet(int(ray[0].row), int(ray[0].column)) = ray[0].surface;
      met.depth(int(ray[0].row), int(ray[0].column)) = ray[0].depth;
    });
  });
  return met;
}

template <class Map>
RayBundle bundle_of(const std::vector<Facet>& facets, int columns, int rows, const Map& map) {
  RayBundle bundle(columns, rows);
  std::vector<RayVertex> corners(3);
  const std::vector<std::array<std::uint32_t, 3>> triangle{{0, 1, 2}};
  for (const Facet& facet : facets) {
    for (std::size_t k = 0; k < 3; ++k) corners[k] = map(facet.corners[k].at_mm);
    bundle.add(corners, triangle);
  }
  return bundle;
}

/// What a lamp sees first along each of its rays. Points behind that are in its shadow.
class Shadow {
 public:
  Shadow(const std::vector<Facet>& facets, const Eigen::Vector3d& towards) {
    axes_.row(2) = -towards.normalized().transpose();
    axes_.row(0) = axes_.row(2).unitOrthogonal();
    axes_.row(1) = axes_.row(2).cross(axes_.row(0));
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
    for (const Facet& facet : facets)
      for (const Corner& corner : facet.corners) {
        low = low.cwiseMin(axes_ * corner.at_mm);
        high = high.cwiseMax(axes_ * corner.at_mm);
      }
    low_ = low;
    const Eigen::Vector3d extent = (high - low) / kShadowStep_mm;
    depth_ = first_met(bundle_of(facets, int(extent.x()) + 2, int(extent.y()) + 2, [&](const Eigen::Vector3d& p) {
               const Eigen::Vector3d seen = at(p);
               return RayVertex{seen.x(), seen.y(), seen.z()};
             })).depth;
  }

  /// The share of the lamp's light that reaches a point, from 3 x 3 rays around it.
  double lit(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d seen = at(p);
    const int u = int(std::lround(seen.x())), v = int(std::lround(seen.y()));
    int count = 0, of = 0;
    for (int y = std::max(0, v - 1); y <= std::min(depth_.rows - 1, v + 1); ++y)
      for (int x = std::max(0, u - 1); x <= std::min(depth_.cols - 1, u + 1); ++x, ++of)
        count += seen.z() < depth_(y, x) + kShadowBias_mm;
    return of > 0 ? double(count) / of : 1;
  }

 private:
  Eigen::Vector3d at(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d seen = axes_ * p - low_;
    return {seen.x() / kShadowStep_mm, seen.y() / kShadowStep_mm, seen.z()};
  }
  Eigen::Matrix3d axes_;
  Eigen::Vector3d low_;
  cv::Mat1d depth_;
};

/// Ideal radius over distorted radius, both in focal lengths, by Newton's method.
double undistorting_factor(const RadialDistortion& distortion, double seen) {
  if (seen == 0) return 1;
  const auto& k = distortion.k;
  double radius = seen;
  for (int i = 0; i < 20; ++i) {
    const double s = radius * radius, value = radius * distortion.factor(s) - seen;
    radius -= value / (1 + s * (3 * k[0] + s * (5 * k[1] + s * 7 * k[2])));
    if (std::abs(value) < 1e-12) break;
  }
  return radius / seen;
}

/// The rays of a photograph: a square grid, finer than the pixels and turned against them. So a border along the
/// columns meets rays at many parts of a pixel, and lies where it should after blur. Without the turn it would be off
/// by up to half the distance of two rays.
class RayGrid {
 public:
  RayGrid(int width_px, int height_px, double margin_px) {
    constexpr double kTurn_rad = 0.365;
    const double c = kRaysAcross * std::cos(kTurn_rad), s = kRaysAcross * std::sin(kTurn_rad);
    grid_from_pixel_ << c, -s, s, c;
    const Eigen::Vector2d middle(0.5 * (width_px - 1), 0.5 * (height_px - 1)),
        half = grid_from_pixel_.cwiseAbs() * (middle + Eigen::Vector2d::Constant(margin_px));
    columns = 2 * int(std::ceil(half.x())) + 1;
    rows = 2 * int(std::ceil(half.y())) + 1;
    offset_ = Eigen::Vector2d(0.5 * (columns - 1), 0.5 * (rows - 1)) - grid_from_pixel_ * middle;
    pixel_from_grid_ = grid_from_pixel_.inverse();
  }
  Eigen::Vector2d ray_at(const Eigen::Vector2d& pixel) const { return grid_from_pixel_ * pixel + offset_; }
  Eigen::Vector2d pixel_of(int column, int row) const {
    return pixel_from_grid_ * (Eigen::Vector2d(column, row) - offset_);
  }
  int columns, rows;

 private:
  Eigen::Matrix2d grid_from_pixel_, pixel_from_grid_;
  Eigen::Vector2d offset_;
};

class Photographer {
 public:
  Photographer(const std::vector<Painted>& bodies, const Camera& camera, const RadialDistortion& distortion,
               const Studio& studio)
      : camera_(camera),
        distortion_(distortion),
        studio_(studio),
        facets_(facets_of(bodies)),
        grid_(camera.width_px, camera.height_px, margin_px()) {
    for (const Lamp& lamp : studio.lamps) shadows_.emplace_back(facets_, lamp.towards);
  }

  /// Light in each pixel of the distorted image.
  cv::Mat3f light() const {
    const cv::Mat3f rays = light_of_rays();
    cv::Mat1f column(camera_.height_px * kRaysAcross, camera_.width_px * kRaysAcross), row(column.size());
    tbb::parallel_for(0, column.rows, [&](int v) {
      for (int u = 0; u < column.cols; ++u) {
        const Eigen::Vector2d seen = slopes(pixel_of(u), pixel_of(v));
        const Eigen::Vector2d slope = seen * undistorting_factor(distortion_, seen.norm());
        const Eigen::Vector2d ray = grid_.ray_at((camera_.intrinsics * slope.homogeneous()).head<2>());
        column(v, u) = float(ray.x());
        row(v, u) = float(ray.y());
      }
    });
    cv::Mat3f distorted, pixels;
    cv::remap(rays, distorted, column, row, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    cv::resize(distorted, pixels, {camera_.width_px, camera_.height_px}, 0, 0, cv::INTER_AREA);
    return pixels;
  }

 private:
  /// How far a lens with barrel distortion sees beyond the corners of a pinhole's image.
  double margin_px() const {
    double most = 1;
    for (const double u : {0.0, camera_.width_px - 1.0})
      for (const double v : {0.0, camera_.height_px - 1.0})
        most = std::max(most, undistorting_factor(distortion_, slopes(u, v).norm()));
    return (most - 1) * std::max(camera_.width_px, camera_.height_px) + 4;
  }

  static double pixel_of(int subsample) { return (subsample + 0.5) / kRaysAcross - 0.5; }
  Eigen::Vector2d slopes(double u, double v) const {
    return {(u - camera_.intrinsics(0, 2)) / camera_.intrinsics(0, 0),
            (v - camera_.intrinsics(1, 2)) / camera_.intrinsics(1, 1)};
  }

  cv::Mat3f light_of_rays() const {
    const FirstMet met = first_met(bundle_of(facets_, grid_.columns, grid_.rows, [&](const Eigen::Vector3d& p) {
      const Eigen::Vector3d seen = camera_.camera_from_world * p;
      if (!(seen.z() > kNearest_mm))
        throw Error(
            formatted("a photographed body reaches behind the camera or closer than {} mm to it", int(kNearest_mm)));
      const Eigen::Vector2d ray = grid_.ray_at((camera_.intrinsics * seen / seen.z()).head<2>());
      return RayVertex{ray.x(), ray.y(), -1 / seen.z()};
    }));
    const Eigen::Vector3d from = source_position_mm(camera_);
    const Eigen::Vector3f backdrop = studio_.backdrop.cast<float>();
    cv::Mat3f light(grid_.rows, grid_.columns, cv::Vec3f(backdrop[0], backdrop[1], backdrop[2]));
    tbb::parallel_for(0, grid_.rows, [&](int row) {
      for (int column = 0; column < grid_.columns; ++column) {
        const int index = met.facet(row, column);
        if (index < 0) continue;
        const Eigen::Vector3d direction = ray_direction(camera_, grid_.pixel_of(column, row));
        const double depth = -1 / met.depth(row, column),
                     ahead = camera_.camera_from_world.rotation.row(2).dot(direction);
        light(row, column) = shade(facets_[std::size_t(index)], from + direction * (depth / ahead), direction);
      }
    });
    return light;
  }

  cv::Vec3f shade(const Facet& facet, const Eigen::Vector3d& p, const Eigen::Vector3d& direction) const {
    Eigen::Vector3d normal = normal_at(facet, p);
    if (normal.dot(direction) > 0) normal = -normal;
    double even = studio_.ambient, shine = 0;
    for (std::size_t i = 0; i < shadows_.size(); ++i) {
      const Eigen::Vector3d towards = studio_.lamps[i].towards.normalized();
      const double cosine = normal.dot(towards);
      if (cosine <= 0) continue;
      const double lit = studio_.lamps[i].strength * shadows_[i].lit(p + kShadowBias_mm * normal);
      even += lit * cosine;
      shine += lit * std::pow(std::max(0.0, normal.dot((towards - direction).normalized())), kShininess);
    }
    const Eigen::Vector3f light =
        (even * facet.body->albedo + facet.body->gloss * shine * Eigen::Vector3d::Ones()).cast<float>();
    return {light[0], light[1], light[2]};
  }

  /// The mean of the corners' normals, weighted by the areas opposite to them.
  static Eigen::Vector3d normal_at(const Facet& facet, const Eigen::Vector3d& p) {
    const auto& [a, b, c] = facet.corners;
    const Eigen::Vector3d whole = (b.at_mm - a.at_mm).cross(c.at_mm - a.at_mm);
    const auto share = [&](const Corner& from, const Corner& to) {
      return std::max(0.0, whole.dot((from.at_mm - p).cross(to.at_mm - p)));
    };
    return (share(b, c) * a.normal + share(c, a) * b.normal + share(a, b) * c.normal).normalized();
  }

  const Camera& camera_;
  const RadialDistortion& distortion_;
  const Studio& studio_;
  std::vector<Facet> facets_;
  RayGrid grid_;
  std::vector<Shadow> shadows_;
};

}  // namespace

Picture photograph(const std::vector<Painted>& bodies, const Camera& camera, const RadialDistortion& distortion,
                   const Studio& studio, const Sensor& sensor, std::uint64_t seed) {
  check_camera(camera, "the photographing camera");
  check_distortion(camera.intrinsics, distortion, camera.width_px, camera.height_px, "the photographing camera");
  for (const Painted& body : bodies) check_mesh(body.surface, "a photographed body");
  cv::Mat3f light = Photographer(bodies, camera, distortion, studio).light();
  if (sensor.blur_px > 0) cv::GaussianBlur(light, light, {}, sensor.blur_px, sensor.blur_px, cv::BORDER_REPLICATE);
  Picture picture{cv::Mat(light.rows, light.cols, CV_8UC3)};
  tbb::parallel_for(0, light.rows, [&](int row) {
    marrow::Random random(seed, std::uint64_t(row));
    for (int column = 0; column < light.cols; ++column)
      for (int k = 0; k < 3; ++k) {
        const double level = 255 * std::pow(std::clamp(double(light(row, column)[k]), 0.0, 1.0), 1 / sensor.gamma);
        const double noisy = level + (sensor.noise_levels > 0 ? sensor.noise_levels * random.normal() : 0);
        picture.pixels.at<cv::Vec3b>(row, column)[k] = std::uint8_t(std::clamp(std::lround(noisy), 0L, 255L));
      }
  });
  return picture;
}

Camera camera_at(const CameraArm& arm, double angle_deg) {
  const double angle = radians(angle_deg);
  const Eigen::Vector3d ahead(-std::sin(angle), std::cos(angle), 0), down(0, 0, -1);
  Camera camera{arm.device.width_px, arm.device.height_px, arm.device.intrinsics, {"camera", "world"}};
  camera.camera_from_world.rotation.row(0) = down.cross(ahead).transpose();
  camera.camera_from_world.rotation.row(1) = down.transpose();
  camera.camera_from_world.rotation.row(2) = ahead.transpose();
  camera.camera_from_world.translation_mm = {0, 0, arm.distance_mm};
  return camera;
}

Camera camera_at_stop(const CameraArm& arm, std::size_t stop, std::uint64_t seed) {
  marrow::Random random(seed, stop);
  return camera_at(arm, arm.angles_deg.at(stop) + arm.repeat_sd_deg * random.normal());
}

Mesh box(const RigidTransform& world_from_box, const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm) {
  Mesh mesh;
  mesh.frame = "world";
  for (int i = 0; i < 8; ++i)
    mesh.vertices_mm.push_back(world_from_box * Eigen::Vector3d(i & 1 ? high_mm.x() : low_mm.x(),
                                                                i & 2 ? high_mm.y() : low_mm.y(),
                                                                i & 4 ? high_mm.z() : low_mm.z()));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

Mesh drum(const RigidTransform& world_from_drum, double radius_mm, double low_mm, double high_mm) {
  constexpr std::uint32_t kSides = 72;
  Mesh mesh;
  mesh.frame = "world";
  for (const double z : {low_mm, high_mm}) {
    mesh.vertices_mm.push_back(world_from_drum * Eigen::Vector3d(0, 0, z));
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const double angle = 2 * kPi * i / kSides;
      mesh.vertices_mm.push_back(world_from_drum *
                                 Eigen::Vector3d(radius_mm * std::cos(angle), radius_mm * std::sin(angle), z));
    }
  }
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t a = 1 + i, b = 1 + (i + 1) % kSides, top = kSides + 1;
    mesh.triangles.insert(mesh.triangles.end(),
                          {{0, b, a}, {top, top + a, top + b}, {a, b, top + a}, {b, top + b, top + a}});
  }
  return mesh;
}

std::vector<Painted> chessboard(const RigidTransform& world_from_board, int columns, int rows, double square_mm) {
  std::vector<Painted> parts(2);
  parts[0].albedo = Eigen::Vector3d::Constant(0.06);
  parts[1].albedo = Eigen::Vector3d::Constant(0.88);
  for (Painted& part : parts) part.surface.frame = "world";
  // Squares from -1 to columns - 1, and one more on each side as the margin.
  for (int row = -2; row <= rows; ++row)
    for (int column = -2; column <= columns; ++column) {
      const bool margin = row == -2 || row == rows || column == -2 || column == columns;
      Mesh& mesh = parts[margin || (row + column) % 2 != 0 ? 1 : 0].surface;
      const auto first = std::uint32_t(mesh.vertices_mm.size());
      for (int i = 0; i < 4; ++i)
        mesh.vertices_mm.push_back(world_from_board *
                                   Eigen::Vector3d((column + (i & 1)) * square_mm, (row + i / 2) * square_mm, 0));
      mesh.triangles.push_back({first, first + 2, first + 1});
      mesh.triangles.push_back({first + 1, first + 2, first + 3});
    }
  return parts;
}

}  // namespace marrow::phantom
