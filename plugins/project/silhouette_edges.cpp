// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/project/surface_patches.hpp"
#include "marrow/project/volume_border.hpp"
#include "marrow/toolbox/geometry/silhouette_image.hpp"

namespace {

struct Options {
  double border_voxels = 2;
};

/// A camera and a pose, relative to the origin of the surface patches.
struct Geometry {
  Eigen::Vector3f source;        ///< position of the source in the model's axes
  Eigen::Matrix3f pixel_matrix;  ///< homogeneous pixel = pixel_matrix * model point + pixel_offset
  Eigen::Vector3f pixel_offset;
  Eigen::Matrix3f line_matrix;  ///< image line = line_matrix * model normal of a plane through the source
};

Geometry geometry_of(const marrow::Camera& camera, const marrow::RigidTransform& world_from_model,
                     const Eigen::Vector3d& origin_mm) {
  const marrow::RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
  const Eigen::Matrix3d& rotation = camera_from_model.rotation;
  const Eigen::Vector3d origin_in_camera = camera_from_model * origin_mm;
  Geometry g;
  g.source = (-(rotation.transpose() * origin_in_camera)).cast<float>();
  g.pixel_matrix = (camera.intrinsics * rotation).cast<float>();
  g.pixel_offset = (camera.intrinsics * origin_in_camera).cast<float>();
  g.line_matrix = (camera.intrinsics.inverse().transpose() * rotation).cast<float>();
  return g;
}

/// Points on the contour generator, the border between the parts of the surface that face the source and the parts that
/// do not. Each lies on the edge between two vertices of the surface. One array for each number, so that a loop over
/// points is computed several at once.
struct ContourPoints {
  std::vector<std::uint32_t> from, to;
  std::vector<float> fraction;  ///< position on the edge: 0 at `from`, 1 at `to`
  std::vector<float> u, v;      ///< in the image; set by project_points()

  void add(std::uint32_t from_vertex, std::uint32_t to_vertex, float at) {
    from.push_back(from_vertex), to.push_back(to_vertex), fraction.push_back(at);
  }
};

/// Pieces of this border, each between two points. Seen from the source, the facing part lies on its left.
struct ContourPieces {
  ContourPoints begin, end;
  std::vector<char> is_rim;  ///< the surface ends there, so this is no outline of the bone
};

/// Marks the patches that may have a normal perpendicular to a line of sight. For such a patch, the angle between the
/// axis of its cone of normals and the plane across the line of sight is at most the cone's angle plus the angle under
/// which the patch is seen. sin(cone) + radius / distance is an upper bound for the sine of this sum.
MARROW_DISPATCH void mark_patches(const SurfacePatches::Bounds& b, const float* source, char* may_cross) {
  const std::size_t count = b.radius.size();
  const float sx = source[0], sy = source[1], sz = source[2];
  for (std::size_t i = 0; i < count; ++i) {
    const float dx = sx - b.x[i], dy = sy - b.y[i], dz = sz - b.z[i];
    const float tilt = std::abs(b.axis_x[i] * dx + b.axis_y[i] * dy + b.axis_z[i] * dz);
    const float most = b.cone_sine[i] * std::sqrt(dx * dx + dy * dy + dz * dz) + b.radius[i];
    may_cross[i] = tilt <= 1.001f * most;
  }
}

/// The vertices of a patch: n . (source - x), and whether this is positive. Returns how many are. Two loops, because a
/// loop over numbers of one size is computed several at once.
MARROW_DISPATCH std::uint32_t face_source(const SurfacePatches& s, std::size_t first, std::size_t count,
                                          const float* source, float* facing, std::uint8_t* front) {
  const float *x = s.x.data() + first, *y = s.y.data() + first, *z = s.z.data() + first, *nx = s.nx.data() + first,
              *ny = s.ny.data() + first, *nz = s.nz.data() + first;
  const float sx = source[0], sy = source[1], sz = source[2];
  for (std::size_t i = 0; i < count; ++i) facing[i] = nx[i] * (sx - x[i]) + ny[i] * (sy - y[i]) + nz[i] * (sz - z[i]);
  std::uint32_t positive = 0;
  for (std::size_t i = 0; i < count; ++i) {
    front[i] = facing[i] > 0;
    positive += front[i];
  }
  return positive;
}

MARROW_DISPATCH void project_points(const SurfacePatches& s, const Geometry& geometry, ContourPoints& points) {
  const std::size_t count = points.fraction.size();
  points.u.resize(count), points.v.resize(count);
  const float *x = s.x.data(), *y = s.y.data(), *z = s.z.data(), *fraction = points.fraction.data();
  const std::uint32_t *from = points.from.data(), *to = points.to.data();
  float *u = points.u.data(), *v = points.v.data();
  const Eigen::Matrix3f m = geometry.pixel_matrix;
  const Eigen::Vector3f o = geometry.pixel_offset;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t i = from[k], j = to[k];
    const float t = fraction[k];
    const float px = x[i] + t * (x[j] - x[i]), py = y[i] + t * (y[j] - y[i]), pz = z[i] + t * (z[j] - z[i]);
    const float inverse = 1 / (m(2, 0) * px + m(2, 1) * py + m(2, 2) * pz + o[2]);
    u[k] = (m(0, 0) * px + m(0, 1) * py + m(0, 2) * pz + o[0]) * inverse;
    v[k] = (m(1, 0) * px + m(1, 1) * py + m(1, 2) * pz + o[1]) * inverse;
  }
}

/// Finds the contour generator as the zero line of g = n . (source - x), which is linear within each triangle. It uses
/// interpolated normals of the vertices, so it is a smooth curve. A curve along the edges of the mesh would zigzag.
class ContourFinder {
 public:
  ContourFinder(const SurfacePatches& surface, const Geometry& geometry) : s_(surface), geometry_(geometry) {}

  ContourPieces find() {
    std::vector<char> may_cross(s_.patches.size());
    mark_patches(s_.bounds, geometry_.source.data(), may_cross.data());
    for (std::size_t i = 0; i < s_.patches.size(); ++i) {
      const auto& patch = s_.patches[i];
      const bool crossed = may_cross[i];
      if (!crossed && !patch.rim_count) continue;
      first_ = patch.first_vertex;
      const std::uint32_t facing =
          face_source(s_, first_, patch.vertex_count, geometry_.source.data(), facing_.data(), front_.data());
      if (facing == 0) continue;
      if (crossed && facing < patch.vertex_count) add_triangles(patch);
      for (std::uint32_t k = 0; k < patch.rim_count; ++k) add_rim(s_.rims[patch.first_rim + k]);
    }
    project_points(s_, geometry_, pieces_.begin);
    project_points(s_, geometry_, pieces_.end);
    return std::move(pieces_);
  }

 private:
  using Triangle = std::array<std::uint8_t, 3>;

  /// First a list of the triangles with corners on both sides, without a branch that cannot be predicted.
  void add_triangles(const SurfacePatches::Patch& patch) {
    const Triangle* triangles = s_.triangles.data() + patch.first_triangle;
    std::array<std::uint32_t, 256> crossed;
    for (std::uint32_t k = 0; k < patch.triangle_count;) {
      std::uint32_t count = 0;
      for (const std::uint32_t end = std::min(patch.triangle_count, k + 256); k < end; ++k) {
        const Triangle& t = triangles[k];
        crossed[count] = k;
        count += std::uint32_t(front_[t[0]] + front_[t[1]] + front_[t[2]] - 1) < 2;
      }
      for (std::uint32_t i = 0; i < count; ++i) add_triangle(triangles[crossed[i]]);
    }
  }

  void add_triangle(const Triangle& t) {
    // Bit k of the row: corner k faces the source. The corner that differs from the two others.
    constexpr std::array<std::uint8_t, 8> kLone{0, 0, 1, 2, 2, 1, 0, 0};
    const int front = front_[t[0]] | front_[t[1]] << 1 | front_[t[2]] << 2;
    const std::size_t lone = kLone[std::size_t(front)];
    const std::uint8_t corner = t[lone], next = t[lone == 2 ? 0 : lone + 1], last = t[lone == 0 ? 2 : lone - 1];
    const bool lone_faces = front_[corner];
    add_between(corner, lone_faces ? next : last, pieces_.begin);
    add_between(corner, lone_faces ? last : next, pieces_.end);
    pieces_.is_rim.push_back(false);
  }

  /// The rim of an open surface also bounds the facing part, but it is not an outline of the bone.
  void add_rim(const std::array<std::uint8_t, 2>& rim) {
    const bool from_front = front_[rim[0]], to_front = front_[rim[1]];
    if (!from_front && !to_front) return;
    const auto vertex = [&](int k) { return std::uint32_t(first_ + rim[std::size_t(k)]); };
    from_front ? pieces_.begin.add(vertex(0), vertex(0), 0) : add_between(rim[0], rim[1], pieces_.begin);
    to_front ? pieces_.end.add(vertex(1), vertex(1), 0) : add_between(rim[0], rim[1], pieces_.end);
    pieces_.is_rim.push_back(true);
  }

  void add_between(std::uint8_t a, std::uint8_t b, ContourPoints& points) const {
    points.add(std::uint32_t(first_ + a), std::uint32_t(first_ + b), facing_[a] / (facing_[a] - facing_[b]));
  }

  const SurfacePatches& s_;
  const Geometry& geometry_;
  std::size_t first_ = 0;
  std::array<float, 256> facing_;
  std::array<std::uint8_t, 256> front_;
  ContourPieces pieces_;
};

/// A crossing of a contour piece with a line of a square grid over the image.
struct Crossing {
  float at_px;  ///< position along the line
  std::int32_t line;
  std::int32_t piece;
  float fraction;  ///< along the piece
  int layers;  ///< change of the number of facing layers at the crossing, in the direction of increasing coordinates
};

/// The lines across which each piece runs: from first[i] to before last[i]. `a`, `b`: the coordinates of its ends
/// across the lines. The interval is half open, so that the joint of two pieces is crossed once.
MARROW_DISPATCH void find_lines(const float* a, const float* b, std::size_t count, float lines_per_px, float lines,
                                std::int32_t* first, std::int32_t* last) {
  for (std::size_t i = 0; i < count; ++i) {
    const float from = a[i] * lines_per_px, to = b[i] * lines_per_px;
    const float low = std::min(from, to), high = std::max(from, to);
    const bool inside = (low < lines) & (high > 0);  // NaN is not
    const float begin = inside ? std::max(low, 0.0f) : 0, end = inside ? std::min(high, lines) : 0;
    // Rounded up; the numbers are not negative. Without SSE 4.1, std::ceil is a slow function call.
    const auto whole_begin = std::int32_t(begin), whole_end = std::int32_t(end);
    first[i] = whole_begin + (float(whole_begin) < begin);
    last[i] = whole_end + (float(whole_end) < end);
  }
}

/// Selects the points on the outer outline from all contour pieces. At these points, the number of facing layers along
/// a line of the image changes between 0 and more. The lines are the rows and columns of a grid, so that the points
/// move smoothly with the pose. Rows give the points of nearly vertical outlines, columns those of nearly horizontal
/// ones.
class OuterOutline {
 public:
  OuterOutline(const SurfacePatches& surface, const ContourPieces& pieces, const marrow::Camera& camera,
               const Geometry& geometry, double spacing_px)
      : surface_(surface),
        pieces_(pieces),
        geometry_(geometry),
        spacing_px_(float(spacing_px)),
        width_px_(camera.width_px),
        height_px_(camera.height_px) {}

  std::vector<marrow::OutlinePoint> find() {
    scan(true);
    scan(false);
    return std::move(points_);
  }

 private:
  void scan(bool rows) {
    const int lines = int((rows ? height_px_ - 1 : width_px_ - 1) / spacing_px_) + 1;
    // Counting sort of the crossings by line.
    crossings_.clear();
    find_crossings(rows, lines);
    std::vector<std::uint32_t> first(std::size_t(lines) + 1, 0);
    for (const Crossing& c : crossings_) ++first[std::size_t(c.line) + 1];
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    std::vector<Crossing> sorted(first.back());
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (const Crossing& c : crossings_) sorted[next[std::size_t(c.line)]++] = c;
    for (int line = 0; line < lines; ++line)
      walk(rows, sorted.begin() + first[std::size_t(line)], sorted.begin() + first[std::size_t(line) + 1]);
  }

  void find_crossings(bool rows, int lines) {
    const ContourPoints &from = pieces_.begin, &to = pieces_.end;
    const std::vector<float>&across_from = rows ? from.v : from.u, &across_to = rows ? to.v : to.u,
          &along_from = rows ? from.u : from.v, &along_to = rows ? to.u : to.v;
    const float lines_per_px = 1 / spacing_px_;
    const std::size_t count = across_from.size();
    first_.resize(count), last_.resize(count), crossed_.resize(count);
    find_lines(across_from.data(), across_to.data(), count, lines_per_px, float(lines), first_.data(), last_.data());
    // Most pieces cross no line or one, so a branch here could not be predicted.
    std::size_t crossed = 0;
    for (std::size_t i = 0; i < count; ++i) {
      crossed_[crossed] = std::uint32_t(i);
      crossed += first_[i] < last_[i];
    }
    for (std::size_t k = 0; k < crossed; ++k) {
      const std::size_t i = crossed_[k];
      const float a = across_from[i] * lines_per_px, b = across_to[i] * lines_per_px;
      for (std::int32_t line = first_[i]; line < last_[i]; ++line) {
        const float t = (float(line) - a) / (b - a), at = along_from[i] + t * (along_to[i] - along_from[i]);
        // The facing part lies on the left of the piece. So a line towards the right enters it where the piece runs
        // down.
        crossings_.push_back({at, line, std::int32_t(i), t, (b > a) == rows ? 1 : -1});
      }
    }
  }

  template <class Iterator>
  void walk(bool rows, Iterator begin, Iterator end) {
    constexpr float kGap_px = 3;  // a narrower gap between two parts of the bone shows no edges in the image
    std::sort(begin, end, [](const Crossing& a, const Crossing& b) {
      return a.at_px != b.at_px ? a.at_px < b.at_px : a.piece < b.piece;
    });
    int layers = 0;
    for (Iterator i = begin; i != end; ++i) {
      const int before = layers;
      layers += i->layers;
      if (before == 0 && layers != 0 && (i == begin || i->at_px - (i - 1)->at_px > kGap_px)) add(rows, *i, -1);
      if (before != 0 && layers == 0 && (i + 1 == end || (i + 1)->at_px - i->at_px > kGap_px)) add(rows, *i, 1);
    }
  }

  /// `outside`: the direction along the line, +1 or -1, in which the bone ends.
  void add(bool rows, const Crossing& crossing, int outside) {
    const auto piece = std::size_t(crossing.piece);
    const ContourPoints &from = pieces_.begin, &to = pieces_.end;
    if (pieces_.is_rim[piece] || !is_usable(from, piece) || !is_usable(to, piece)) return;
    const float t = crossing.fraction;
    const Eigen::Vector3f normal = (1 - t) * normal_at(from, piece) + t * normal_at(to, piece);
    // The tangent plane contains the ray, so it is projected to the tangent of the outline.
    const Eigen::Vector2f image_normal = (geometry_.line_matrix * normal).head<2>().normalized();
    const float cosine = image_normal[rows ? 0 : 1], sine = image_normal[rows ? 1 : 0];
    if (cosine * float(outside) <= 0 || std::abs(cosine) < std::abs(sine)) return;
    if (!rows && std::abs(cosine) == std::abs(sine)) return;
    marrow::OutlinePoint point;
    point.u_px = from.u[piece] + t * (to.u[piece] - from.u[piece]);
    point.v_px = from.v[piece] + t * (to.v[piece] - from.v[piece]);
    if (!(point.u_px >= 0 && point.v_px >= 0 && point.u_px <= float(width_px_ - 1) &&
          point.v_px <= float(height_px_ - 1)))
      return;
    point.normal_u = image_normal[0];
    point.normal_v = image_normal[1];
    point.model_mm = surface_.origin_mm.cast<float>() + (1 - t) * model_at(from, piece) + t * model_at(to, piece);
    points_.push_back(point);
  }

  /// In front of the source, and where the CT does not end.
  bool is_usable(const ContourPoints& points, std::size_t i) const {
    const float depth = geometry_.pixel_matrix.row(2).dot(model_at(points, i)) + geometry_.pixel_offset[2];
    return depth > 0 && !surface_.at_border[points.from[i]] && !surface_.at_border[points.to[i]];
  }
  Eigen::Vector3f normal_at(const ContourPoints& points, std::size_t i) const {
    return between(surface_.nx, surface_.ny, surface_.nz, points, i);
  }
  Eigen::Vector3f model_at(const ContourPoints& points, std::size_t i) const {
    return between(surface_.x, surface_.y, surface_.z, points, i);
  }
  static Eigen::Vector3f between(const std::vector<float>& x, const std::vector<float>& y, const std::vector<float>& z,
                                 const ContourPoints& points, std::size_t i) {
    const std::uint32_t a = points.from[i], b = points.to[i];
    const Eigen::Vector3f from(x[a], y[a], z[a]), to(x[b], y[b], z[b]);
    return from + points.fraction[i] * (to - from);
  }

  const SurfacePatches& surface_;
  const ContourPieces& pieces_;
  const Geometry& geometry_;
  const float spacing_px_;
  const int width_px_, height_px_;
  std::vector<std::int32_t> first_, last_;  ///< lines that each piece crosses
  std::vector<std::uint32_t> crossed_;      ///< pieces that cross one at least
  std::vector<Crossing> crossings_;
  std::vector<marrow::OutlinePoint> points_;
};

class SilhouetteEdges : public marrow::OutlineProjector {
 public:
  SilhouetteEdges(SurfacePatches surface, SurfacePatches coarse)
      : surface_(std::move(surface)), coarse_(std::move(coarse)) {}

  std::vector<marrow::OutlinePoint> outline(const marrow::Camera& camera,
                                            const marrow::RigidTransform& world_from_model,
                                            double spacing_px) const override {
    if (!(spacing_px > 0)) throw marrow::Error("the outline's spacing must be positive");
    const SurfacePatches& surface = spacing_px >= kCoarse_px && !coarse_.patches.empty() ? coarse_ : surface_;
    const Geometry geometry = geometry_of(camera, world_from_model, surface.origin_mm);
    const ContourPieces pieces = ContourFinder(surface, geometry).find();
    return OuterOutline(surface, pieces, camera, geometry, spacing_px).find();
  }

 private:
  static constexpr double kCoarse_px = 4;  ///< from this spacing on, the coarse surface is accurate enough
  SurfacePatches surface_, coarse_;
};

std::shared_ptr<const marrow::OutlineProjector> silhouette_edges(const marrow::Mesh& mesh, const marrow::Volume* volume,
                                                                 const Options& options) {
  marrow::check_mesh(mesh, "the mesh to project");
  constexpr std::size_t kWorthIt = 20000;  // with fewer triangles, a coarse surface saves no time
  const std::vector<char> at_border = marrow::rays::vertices_at_volume_border(mesh, volume, options.border_voxels);
  SurfacePatches coarse;
  if (mesh.triangles.size() >= kWorthIt) {
    marrow::geometry::CoarseSurface surface = marrow::geometry::coarse_surface(mesh, at_border);
    if (!surface.mesh.triangles.empty()) coarse = make_surface_patches(surface.mesh, surface.at_border);
  }
  return std::make_shared<SilhouetteEdges>(make_surface_patches(mesh, at_border), std::move(coarse));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("project.silhouette_edges", silhouette_edges)
      .summary("Exact outer outline of a surface: the curve where it turns away from the X-ray source")
      .in("model", "surface of the bone")
      .in("volume", "CT from which the surface was made; outline within border_voxels of its end is left out")
      .out("projector", "draws the outline for any camera and pose")
      .option("border_voxels", &Options::border_voxels, "outline closer than this to the end of the CT is left out",
              marrow::at_least(0), marrow::unit("voxels"));
}
