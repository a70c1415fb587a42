// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/shape_library.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/toolbox/geometry/silhouette_image.hpp"

namespace marrow::initial {
namespace {

constexpr int kDrawn_px = 100;  ///< the surface's diameter in a drawing

/// The direction number `i` of `count`, spread evenly over the sphere (Fibonacci's lattice).
Eigen::Vector3d direction(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count, around = i * kPi * (3 - std::sqrt(5.0)), across = std::sqrt(1 - z * z);
  return {across * std::cos(around), across * std::sin(around), z};
}

/// The least rotation that turns one direction into another.
Eigen::Matrix3d turned(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
}

/// Outlines as another camera at the same place sees them, which looks along a ray.
std::vector<Eigen::Vector2d> seen_along(const std::vector<Eigen::Vector2d>& rays, const Eigen::Matrix3d& looking) {
  std::vector<Eigen::Vector2d> result;
  for (const Eigen::Vector2d& ray : rays) result.push_back((looking * ray.homogeneous()).hnormalized());
  return result;
}

Eigen::AlignedBox3d box_of(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) box.extend(vertex);
  return box;
}

}  // namespace

ShapeLibrary::ShapeLibrary(const Mesh& surface, const SeenSilhouette& about, int directions, Context& context)
    : frame_(surface.frame), middle_mm_(box_of(surface).center()) {
  double radius_mm = 0, mean_square_mm2 = 0;
  for (const Eigen::Vector3d& vertex : surface.vertices_mm) {
    const double square = (vertex - middle_mm_).squaredNorm();
    radius_mm = std::max(radius_mm, std::sqrt(square));
    mean_square_mm2 += square / double(surface.vertices_mm.size());
  }
  // Two of three coordinates of a vertex are seen.
  const double size = outline_shape(outline_rays(about.mask, about.camera)).size;
  distance_mm_ = std::max(std::sqrt(2 * mean_square_mm2 / 3) / size, 2 * radius_mm);
  Camera camera;
  camera.width_px = camera.height_px = kDrawn_px + 20;
  const double focal_px = 0.5 * kDrawn_px * (distance_mm_ - radius_mm) / radius_mm, middle_px = 0.5 * (kDrawn_px + 19);
  camera.intrinsics << focal_px, 0, middle_px, 0, focal_px, middle_px, 0, 0, 1;
  sides_.resize(std::size_t(directions));
  tbb::parallel_for(0, directions, [&](int i) {
    context.check_cancelled();
    Side& side = sides_[std::size_t(i)];
    side.camera_from_model = turned(direction(i, directions), Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d there_mm = Eigen::Vector3d(0, 0, distance_mm_) - side.camera_from_model * middle_mm_;
    const cv::Mat1b mask =
        geometry::silhouette_image(surface, camera, {"world", frame_, side.camera_from_model, there_mm}) >= 0;
    side.shape = outline_shape(outline_rays(mask, camera));
  });
}

std::vector<ShapeLibrary::Match> ShapeLibrary::matches(const SeenSilhouette& seen) const {
  const std::vector<Eigen::Vector2d> rays = outline_rays(seen.mask, seen.camera);
  const std::complex<double> middle = outline_shape(rays).middle;
  const Eigen::Matrix3d looking = turned(Eigen::Vector3d(middle.real(), middle.imag(), 1), Eigen::Vector3d::UnitZ());
  const OutlineShape shape = outline_shape(seen_along(rays, looking));
  const RigidTransform world_from_camera = inverse(seen.camera.camera_from_world);
  std::vector<Match> matches(sides_.size());
  tbb::parallel_for(std::size_t(0), sides_.size(), [&](std::size_t i) {
    const Side& side = sides_[i];
    const Likeness alike = likeness(shape, side.shape);
    const double scale = shape.size / side.shape.size;
    const std::complex<double> at = shape.middle - scale * std::polar(1.0, alike.turn_rad) * side.shape.middle;
    const Eigen::Vector3d ray(at.real(), at.imag(), 1);
    const Eigen::Matrix3d in_image = Eigen::AngleAxisd(alike.turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    RigidTransform camera_from_model{seen.camera.camera_from_world.target, frame_};
    camera_from_model.rotation =
        looking.transpose() * turned(Eigen::Vector3d::UnitZ(), ray) * in_image * side.camera_from_model;
    camera_from_model.translation_mm =
        looking.transpose() * (distance_mm_ / scale * ray) - camera_from_model.rotation * middle_mm_;
    matches[i] = {world_from_camera * camera_from_model, alike.value};
  });
  std::stable_sort(matches.begin(), matches.end(),
                   [](const Match& a, const Match& b) { return a.likeness > b.likeness; });
  return matches;
}

namespace {

constexpr int kPoints = 128;  ///< along an outline
using Complex = std::complex<double>;

/// The roots of unity of the number of points.
const std::array<Complex, kPoints>& roots() {
  static const std::array<Complex, kPoints> all = [] {
    std::array<Complex, kPoints> values;
    for (int i = 0; i < kPoints; ++i)
      values[std::size_t(i)] = {std::cos(2 * kPi * i / kPoints), std::sin(2 * kPi * i / kPoints)};
    return values;
  }();
  return all;
}

/// exp(2 pi i order * at / kPoints).
Complex root(int order, int at) { return roots()[std::size_t(((order * at) % kPoints + kPoints) % kPoints)]; }

/// The order of a term: -kOrders to -1, then 1 to kOrders.
int order_of(int term) {
  return term < OutlineShape::kOrders ? term - OutlineShape::kOrders : term + 1 - OutlineShape::kOrders;
}

/// kPoints points, evenly spaced along the polygon.
std::array<Complex, kPoints> evenly_spaced(const std::vector<Eigen::Vector2d>& polygon) {
  std::vector<double> passed{0};
  for (std::size_t i = 0; i < polygon.size(); ++i)
    passed.push_back(passed.back() + (polygon[(i + 1) % polygon.size()] - polygon[i]).norm());
  if (!(passed.back() > 0) || !std::isfinite(passed.back())) throw Error("an outline has no length");
  std::array<Complex, kPoints> points;
  std::size_t side = 0;
  for (int k = 0; k < kPoints; ++k) {
    const double at = passed.back() * k / kPoints;
    while (side + 1 < polygon.size() && passed[side + 1] <= at) ++side;
    const double length = passed[side + 1] - passed[side];
    const Eigen::Vector2d point = polygon[side] + (length > 0 ? (at - passed[side]) / length : 0) *
                                                      (polygon[(side + 1) % polygon.size()] - polygon[side]);
    points[std::size_t(k)] = {point.x(), point.y()};
  }
  return points;
}

}  // namespace

OutlineShape outline_shape(const std::vector<Eigen::Vector2d>& polygon) {
  const std::array<Complex, kPoints> points = evenly_spaced(polygon);
  OutlineShape shape;
  for (const Complex& point : points) shape.middle += point / double(kPoints);
  double norm = 0;
  for (const Complex& point : points) shape.size += std::norm(point - shape.middle) / kPoints;
  shape.size = std::sqrt(shape.size);
  for (int term = 0; term < 2 * OutlineShape::kOrders; ++term) {
    Complex sum = 0;
    for (int k = 0; k < kPoints; ++k) sum += points[std::size_t(k)] * std::conj(root(order_of(term), k));
    shape.terms[std::size_t(term)] = sum;
    norm += std::norm(sum);
  }
  for (Complex& term : shape.terms) term /= std::sqrt(norm);
  return shape;
}

Likeness likeness(const OutlineShape& seen, const OutlineShape& drawn) {
  std::array<Complex, 2 * OutlineShape::kOrders> products;
  for (std::size_t term = 0; term < products.size(); ++term)
    products[term] = seen.terms[term] * std::conj(drawn.terms[term]);
  Complex best = 0;
  for (int start = 0; start < kPoints; ++start) {
    Complex sum = 0;
    for (int term = 0; term < 2 * OutlineShape::kOrders; ++term)
      sum += products[std::size_t(term)] * root(order_of(term), start);
    if (std::norm(sum) > std::norm(best)) best = sum;
  }
  return {std::abs(best), std::arg(best)};
}

namespace {

struct Pieces {
  cv::Mat1b mask;    ///< 255 in the pieces that count
  cv::Rect largest;  ///< the box of the largest one
  int area_px = 0;   ///< of the largest one
};

Pieces pieces_of(const cv::Mat1b& mask) {
  constexpr double kLeastPart = 0.05;
  cv::Mat labels, figures, centres;
  const int count = cv::connectedComponentsWithStats(mask != 0, labels, figures, centres, 8, CV_32S);
  const auto area = [&](int piece) { return figures.at<int>(piece, cv::CC_STAT_AREA); };
  int largest = 1;
  for (int piece = 2; piece < count; ++piece)
    if (area(piece) > area(largest)) largest = piece;
  Pieces pieces{cv::Mat1b(mask.size(), std::uint8_t(0)), {}, 0};
  for (int piece = 1; piece < count; ++piece)
    if (area(piece) >= kLeastPart * area(largest)) pieces.mask.setTo(255, labels == piece);
  pieces.largest = {figures.at<int>(largest, cv::CC_STAT_LEFT), figures.at<int>(largest, cv::CC_STAT_TOP),
                    figures.at<int>(largest, cv::CC_STAT_WIDTH), figures.at<int>(largest, cv::CC_STAT_HEIGHT)};
  pieces.area_px = area(largest);
  return pieces;
}

/// The part of an image in a box that may reach beyond it; nothing is seen there.
cv::Mat1b cut_out(const cv::Mat1b& image, const cv::Rect& box) {
  cv::Mat1b result(box.size(), std::uint8_t(0));
  const cv::Rect inside = box & cv::Rect({0, 0}, image.size());
  image(inside).copyTo(result(inside - box.tl()));
  return result;
}

}  // namespace

SeenSilhouette seen_silhouette(const View& view, int size_px, const std::string& node) {
  check_view(view);
  const std::string where = node + ": view '" + view.name + "': ";
  if (view.mask.empty())
    throw Error(where + "it has no mask, so no silhouette; wire a node of the kind mask, such as mask.network with " +
                "leave_out: [background]");
  const int seen_px = cv::countNonZero(view.mask);
  if (seen_px == 0) throw Error(where + "its mask is empty, so the part is not seen; look at the mask's node");
  if (std::size_t(seen_px) == view.mask.total())
    throw Error(where + "its mask is the whole image, which is no silhouette; look at the mask's node");
  const Pieces pieces = pieces_of(view.mask);
  const cv::Rect& box = pieces.largest;
  const int margin = std::max(4, int(0.5 * std::max(box.width, box.height)));
  const cv::Rect around(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin);
  const double scale = std::min(1.0, size_px / std::sqrt(double(pieces.area_px)));
  SeenSilhouette seen;
  seen.is_whole = box.x > 0 && box.y > 0 && box.br().x < view.mask.cols && box.br().y < view.mask.rows;
  const cv::Size size(int(std::lround(scale * around.width)), int(std::lround(scale * around.height)));
  cv::resize(cut_out(pieces.mask, around), seen.mask, size, 0, 0, cv::INTER_AREA);
  seen.mask = seen.mask >= 128;
  seen.camera = view.camera;
  seen.camera.width_px = size.width, seen.camera.height_px = size.height;
  const double by_u = double(size.width) / around.width, by_v = double(size.height) / around.height;
  Eigen::Matrix3d to_own;
  to_own << by_u, 0, by_u * (0.5 - around.x) - 0.5, 0, by_v, by_v * (0.5 - around.y) - 0.5, 0, 0, 1;
  seen.camera.intrinsics = to_own * view.camera.intrinsics;
  cv::Mat1f outside, inside;
  cv::distanceTransform(~seen.mask, outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(seen.mask, inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  seen.distance = outside - inside;
  // The border lies between the centres of the pixels on its sides.
  for (float& value : seen.distance) value += value > 0 ? -0.5F : 0.5F;
  return seen;
}

std::vector<Eigen::Vector2d> outline_rays(const cv::Mat1b& mask, const Camera& camera) {
  std::vector<std::vector<cv::Point>> chains;
  cv::findContours(mask, chains, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<Eigen::Vector2d> rays;
  if (chains.empty()) return rays;
  const auto largest = std::max_element(chains.begin(), chains.end(), [](const auto& a, const auto& b) {
    return cv::contourArea(a) < cv::contourArea(b);
  });
  const Eigen::Matrix3d ray_from_pixel = camera.intrinsics.inverse();
  for (const cv::Point& pixel : *largest)
    rays.push_back((ray_from_pixel * Eigen::Vector3d(pixel.x, pixel.y, 1)).hnormalized());
  return rays;
}

double overlap(const cv::Mat1b& one, const cv::Mat1b& other) {
  const int any = cv::countNonZero(one | other);
  return any > 0 ? double(cv::countNonZero(one & other)) / any : 0;
}

}  // namespace marrow::initial
