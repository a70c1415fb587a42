// SPDX-License-Identifier: Apache-2.0
// Checks for nodes of the kind shaft, with the exact lines of a hollow cylinder in soft tissue. The edge pixels have
// errors of position and direction, gaps and clutter. The image shows the same cylinder.
#include <marrow/plugin.hpp>
#include <random>

namespace {

using namespace marrow;
using namespace marrow::conformance;

constexpr int kWidth = 480, kHeight = 512;
constexpr double kFocal_px = 1700, kDistance_mm = 600, kThigh_mm = 70;
constexpr double kPosition_px = 0.6, kDirection_deg = 6,
                 kFound = 0.85;  // standard deviations of edge pixels, and the fraction of pixels that are found

/// A straight hollow bone.
struct Bone {
  Eigen::Vector3d point, direction;
  double outer_mm = 28, canal_mm = 12;  // diameters
};

/// A line in the image: normal . p = rho. The normal points to the brighter side.
struct Line {
  Eigen::Vector2d normal;
  double rho;
  double distance(const Eigen::Vector2d& p) const { return normal.dot(p) - rho; }
};

double noise(std::mt19937& random) {  // nearly normal: the sum of twelve uniform numbers
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += double(random()) / 4294967296.0;
  return sum;
}
double uniform(std::mt19937& random, double from, double to) {
  return from + (to - from) * double(random()) / 4294967296.0;
}

std::vector<Bone> bones() {
  std::mt19937 random(3);
  std::vector<Bone> list;
  for (int i = 0; i < 8; ++i)
    list.push_back({Eigen::Vector3d(uniform(random, -20, 20), uniform(random, -20, 20), uniform(random, -15, 15)),
                    Eigen::Vector3d(uniform(random, -0.5, 0.5), 1, uniform(random, -0.2, 0.2)).normalized(),
                    uniform(random, 25, 33), uniform(random, 9, 15)});
  return list;
}

Camera camera() {
  Camera camera;
  camera.width_px = kWidth;
  camera.height_px = kHeight;
  camera.intrinsics << kFocal_px, 0, 0.5 * (kWidth - 1), 0, kFocal_px, 0.5 * (kHeight - 1), 0, 0, 1;
  camera.camera_from_world.translation_mm = {0, 0, kDistance_mm};
  return camera;
}

/// The image lines of the planes through the source that touch a cylinder, with normals away from its axis.
std::array<Line, 2> tangents(const Bone& bone, double diameter_mm) {
  const Camera view = camera();
  const Eigen::Vector3d source = source_position_mm(view);
  const Eigen::Vector3d& d = bone.direction;
  Eigen::Vector3d to_axis = bone.point - source;
  to_axis -= d * d.dot(to_axis);
  const double sine = 0.5 * diameter_mm / to_axis.norm(), cosine = std::sqrt(1 - sine * sine);
  std::array<Line, 2> lines;
  for (int side = 0; side < 2; ++side) {
    const Eigen::Vector3d normal =
        (side ? -cosine : cosine) * d.cross(to_axis.normalized()) - sine * to_axis.normalized();
    const Eigen::Vector3d line = view.intrinsics.inverse().transpose() * (view.camera_from_world.rotation * normal);
    const double scale = line.head<2>().norm();
    lines[std::size_t(side)] = {line.head<2>() / scale, -line.z() / scale};
  }
  return lines;
}

Line turned(Line line) { return {-line.normal, -line.rho}; }

EdgePixel pixel_of(const Eigen::Vector2d& at, double angle) {
  return {float(at.x()), float(at.y()), float(std::cos(angle)), float(std::sin(angle)), 300};
}

void draw(const Line& line, std::mt19937& random, std::vector<EdgePixel>& pixels) {
  const Eigen::Vector2d along(-line.normal.y(), line.normal.x()), middle(0.5 * kWidth, 0.5 * kHeight);
  const double s0 = along.dot(middle), angle = std::atan2(line.normal.y(), line.normal.x());
  for (double s = s0 - 400; s < s0 + 400; s += 1) {
    const double off = kPosition_px * noise(random), turn = radians(kDirection_deg) * noise(random);
    const bool found = uniform(random, 0, 1) < kFound;
    const Eigen::Vector2d at = s * along + (line.rho + off) * line.normal;
    if (found && at.x() > 0 && at.y() > 0 && at.x() < kWidth - 1 && at.y() < kHeight - 1)
      pixels.push_back(pixel_of(at, angle + turn));
  }
}

/// Edge pixels at random places, each with a few neighbours, like edges from noise.
void scatter(int count, std::mt19937& random, std::vector<EdgePixel>& pixels) {
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d at(uniform(random, 1, kWidth - 12), uniform(random, 1, kHeight - 12));
    const double angle = uniform(random, -kPi, kPi);
    for (int k = 0; k < 6; ++k)
      pixels.push_back(
          pixel_of(at + 1.3 * k * Eigen::Vector2d(std::abs(std::sin(angle)), std::abs(std::cos(angle))), angle));
  }
}

EdgeMap map_of(std::vector<EdgePixel> pixels, int width = kWidth, int height = kHeight) {
  std::stable_sort(pixels.begin(), pixels.end(), [](const EdgePixel& a, const EdgePixel& b) {
    return std::pair(std::lround(a.v_px), std::lround(a.u_px)) < std::pair(std::lround(b.v_px), std::lround(b.u_px));
  });
  return {width, height, std::move(pixels)};
}

/// The parts that appear in the edge map. The image always shows all parts.
struct Shown {
  bool outer = true, canal = true, thigh = true;
  int clutter = 120;
};

EdgeMap edges_of(const Bone& bone, const Shown& shown = {}) {
  std::mt19937 random(11);
  std::vector<EdgePixel> pixels;
  const Bone thigh{{0, 0, 0}, Eigen::Vector3d::UnitY()};
  for (const Line& line : tangents(bone, bone.outer_mm))
    if (shown.outer) draw(line, random, pixels);
  for (const Line& line : tangents(bone, bone.canal_mm))
    if (shown.canal) draw(turned(line), random, pixels);  // marrow is brighter than the cortex
  for (const Line& line : tangents(thigh, 2 * kThigh_mm))
    if (shown.thigh) draw(line, random, pixels);
  scatter(shown.clutter, random, pixels);
  return map_of(std::move(pixels));
}

/// Length of a ray inside a cylinder.
double chord_mm(const Eigen::Vector3d& source, const Eigen::Vector3d& ray, const Bone& bone, double diameter_mm) {
  const Eigen::Vector3d across = ray - bone.direction * ray.dot(bone.direction), from = source - bone.point,
                        start = from - bone.direction * from.dot(bone.direction);
  const double a = across.squaredNorm(), b = across.dot(start),
               c = start.squaredNorm() - 0.25 * diameter_mm * diameter_mm;
  return 2 * std::sqrt(std::max(0.0, b * b - a * c)) / a;
}

View view_of(const Bone& bone) {
  View view{"frontal", {}, camera(), {}};
  std::mt19937 random(7);
  view.image.pixels.create(kHeight, kWidth, CV_16U);
  const Eigen::Vector3d source = source_position_mm(view.camera);
  const Bone thigh{{0, 0, 0}, Eigen::Vector3d::UnitY()};
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const Eigen::Vector3d ray = ray_direction(view.camera, Eigen::Vector2d(u, v));
      const double path = 0.024 * chord_mm(source, ray, thigh, 2 * kThigh_mm) +
                          0.056 * chord_mm(source, ray, bone, bone.outer_mm) -
                          0.059 * chord_mm(source, ray, bone, bone.canal_mm);
      const double mean = 60000 * std::exp(-path);
      view.image.pixels.at<std::uint16_t>(v, u) =
          std::uint16_t(std::clamp(mean + 4 * std::sqrt(mean) * noise(random), 0.0, 65535.0));
    }
  return view;
}

Inputs inputs_of(const Bone& bone, EdgeMap edges) {
  return {{"edges", item(std::move(edges))}, {"view", item(view_of(bone))}};
}
Inputs inputs_of(const Bone& bone, const Shown& shown = {}) { return inputs_of(bone, edges_of(bone, shown)); }

bool is_inside(const LineSegment& segment) {
  const auto inside = [](const Eigen::Vector2d& p) {
    return p.allFinite() && p.x() > -9 && p.y() > -9 && p.x() < kWidth + 9 && p.y() < kHeight + 9;
  };
  return inside(segment.from_px) && inside(segment.to_px);
}

void validate(const Inputs&, const std::vector<PortInfo>&, const std::vector<Value>& outputs) {
  expect(outputs.size() == 1 && !outputs[0].is_absent(), "it gives no lines");
  const ShaftLines& lines = outputs[0].as<ShaftLines>();
  expect(is_inside(lines.left) && is_inside(lines.right), "a border is not finite, or runs out of the image");
  const Eigen::Vector2d left = lines.left.to_px - lines.left.from_px, right = lines.right.to_px - lines.right.from_px;
  expect(left.norm() > 1 && right.norm() > 1, "a border has no length");
  expect(left.dot(right) > 0, "its borders do not run the same way");
  const Eigen::Vector2d to_left(left.y(), -left.x());  // v runs down
  expect(to_left.dot(lines.left.from_px + lines.left.to_px - lines.right.from_px - lines.right.to_px) > 0,
         "its left border is not on the left when looking from 'from' to 'to'");
  expect(std::isfinite(lines.width_mm) && lines.width_mm > 0, "its width is not a positive number");
  expect(std::isfinite(lines.width_deviation_mm) && lines.width_deviation_mm > 0, "its width has no uncertainty");
  expect(std::isfinite(lines.log_likelihood), "its likelihood is not finite");
  for (const ShaftLines::Rejected& pair : lines.rejected)
    expect(pair.reason.size() > 10, "a pair is rejected without saying why: '" + pair.reason + "'");
}

/// Error of a border against a true line: in direction, and in the middle of its length.
struct Offness {
  double angle_deg, middle_mm;
};
Offness error_of(const LineSegment& border, const Line& truth) {
  const Eigen::Vector2d way = (border.to_px - border.from_px).normalized();
  return {degrees(std::asin(std::min(1.0, std::abs(truth.normal.dot(way))))),
          std::abs(truth.distance(0.5 * (border.from_px + border.to_px))) * kDistance_mm / kFocal_px};
}

/// The larger errors of a pair against two true lines, in the better of both assignments.
Offness error_of(const LineSegment& left, const LineSegment& right, const std::array<Line, 2>& truth) {
  const auto both = [&](std::size_t i) {
    const Offness one = error_of(left, truth[i]), other = error_of(right, truth[1 - i]);
    return Offness{std::max(one.angle_deg, other.angle_deg), std::max(one.middle_mm, other.middle_mm)};
  };
  const Offness a = both(0), b = both(1);
  return a.middle_mm < b.middle_mm ? a : b;
}

ShaftLines lines_of(const Subject& subject, const Bone& bone) {
  return subject.output(inputs_of(bone), "lines").as<ShaftLines>();
}

/// The largest figure over all bones.
double largest(const Subject& subject, const std::function<double(const Bone&, const ShaftLines&)>& figure) {
  double most = 0;
  for (const Bone& bone : bones()) most = std::max(most, figure(bone, lines_of(subject, bone)));
  return most;
}

double wrong_percent(const Subject& subject) {
  int wrong = 0;
  for (const Bone& bone : bones()) {
    const ShaftLines lines = lines_of(subject, bone);
    wrong += error_of(lines.left, lines.right, tangents(bone, bone.outer_mm)).middle_mm > 1.5;
  }
  return 100.0 * wrong / double(bones().size());
}

double canal_unseen_percent(const Subject& subject) {
  int unseen = 0;
  for (const Bone& bone : bones()) {
    const auto canal = tangents(bone, bone.canal_mm);
    const ShaftLines lines = lines_of(subject, bone);
    unseen += std::none_of(lines.rejected.begin(), lines.rejected.end(),
                           [&](const auto& pair) { return error_of(pair.left, pair.right, canal).middle_mm < 1.5; });
  }
  return 100.0 * unseen / double(bones().size());
}

/// The largest error of the width at the depth that a C-arm has its isocentre, in units of the deviation that the node
/// gives.
double width_error(const Subject& subject) {
  return largest(subject, [](const Bone& bone, const ShaftLines& lines) {
    const double nearer = kDistance_mm / (kDistance_mm + bone.point.z());
    return std::abs(lines.width_mm - bone.outer_mm * nearer) / lines.width_deviation_mm;
  });
}

double length_missed(const Subject& subject) {
  return largest(subject, [](const Bone&, const ShaftLines& lines) {
    return 100 * std::max(0.0, 1 - (lines.left.to_px - lines.left.from_px).norm() / (kHeight - 60));
  });
}

double refuses(const Subject& subject, const Shown& shown) {
  const Result result = subject.call(inputs_of(bones()[0], shown));
  expect(result.refusal.has_value(), "it gives a pair, where there is no outer border");
  return 0;
}

std::vector<Trial> trials() {
  const auto with = [](auto change) {
    return [change] {
      EdgeMap edges = edges_of(bones()[0]);
      change(edges);
      return inputs_of(bones()[0], std::move(edges));
    };
  };
  return {{"empty_map", with([](EdgeMap& edges) { edges.pixels.clear(); })},
          {"one_pixel", with([](EdgeMap& edges) { edges.pixels.resize(1); })},
          {"all_clutter",
           [] {
             return inputs_of(bones()[0], {false, false, false, 1500});
           }},
          {"nan_pixel", with([](EdgeMap& edges) { edges.pixels[40].u_px = std::nanf(""); })},
          {"nan_direction", with([](EdgeMap& edges) { edges.pixels[40].direction_v = std::nanf(""); })},
          {"other_size", with([](EdgeMap& edges) { edges.width_px = 100; })},
          {"pixel_far_outside", with([](EdgeMap& edges) { edges.pixels[40].v_px = 1e9f; })},
          {"all_in_one_place",
           with([](EdgeMap& edges) { std::fill(edges.pixels.begin(), edges.pixels.end(), edges.pixels[40]); })},
          {"huge_map", with([](EdgeMap& edges) {
             std::vector<EdgePixel> pixels = edges.pixels;
             std::mt19937 random(5);
             scatter(15000, random, pixels);
             edges = map_of(std::move(pixels));
           })},
          {"constant_image",
           [] {
             View view = view_of(bones()[0]);
             view.image.pixels = 1000;
             return Inputs{{"edges", item(edges_of(bones()[0]))}, {"view", item(view)}};
           }},
          {"nan_image",
           [] {
             View view = view_of(bones()[0]);
             view.image.pixels.convertTo(view.image.pixels, CV_32F);
             view.image.pixels.rowRange(200, 260) = std::nanf("");
             return Inputs{{"edges", item(edges_of(bones()[0]))}, {"view", item(view)}};
           }},
          {"empty_image",
           [] {
             View view{"frontal", {}, {}, {}};
             return Inputs{{"edges", item(EdgeMap())}, {"view", item(view)}};
           }},
          {"world_origin_behind_source", [] {
             View view = view_of(bones()[0]);
             view.camera.camera_from_world.translation_mm.z() = -kDistance_mm;
             return Inputs{{"edges", item(edges_of(bones()[0]))}, {"view", item(view)}};
           }}};
}

Suite suite_of_kind() {
  Suite suite{[] { return inputs_of(bones()[0]); }, validate, trials(), {}};
  const std::string of =
      "8 hollow cylinders in soft tissue, edges with errors of 0.6 px, 15 % of them missing, clutter: ";
  const auto error = [](const Bone& bone, const ShaftLines& lines) {
    return error_of(lines.left, lines.right, tangents(bone, bone.outer_mm));
  };
  suite.add("right_pair", of + "pairs that are not the outer borders", 0, "%", wrong_percent);
  suite.add("angle", of + "largest angle between a border and the true one", 0.15, "deg", [=](const Subject& subject) {
    return largest(subject, [=](const Bone& bone, const ShaftLines& lines) { return error(bone, lines).angle_deg; });
  });
  suite.add("offset", of + "largest distance from the middle of a border to the true one", 0.1, "mm",
            [=](const Subject& subject) {
              return largest(subject,
                             [=](const Bone& bone, const ShaftLines& lines) { return error(bone, lines).middle_mm; });
            });
  suite.add("width", of + "largest error of the width, in units of the deviation that the node gives", 3, "sigma",
            width_error);
  suite.add("length", of + "largest part of the shaft that the borders miss", 25, "%", length_missed);
  suite.add("canal_named", of + "cases in which the rejected pairs do not include the canal", 13, "%",
            canal_unseen_percent);
  suite.add("canal_alone", "refuses an image with no other edges than the canal's borders", 0, "",
            [](const Subject& subject) {
              return refuses(subject, {false, true, false, 120});
            });
  suite.add("tissue_alone", "refuses an image with no other edges than the limb's borders", 0, "",
            [](const Subject& subject) {
              return refuses(subject, {false, false, true, 120});
            });
  return suite;
}

}  // namespace

MARROW_PLUGIN(plugin) { plugin.suite("shaft", suite_of_kind()); }
