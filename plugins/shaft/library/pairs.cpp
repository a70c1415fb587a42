// SPDX-License-Identifier: Apache-2.0
#include "marrow/shaft/pairs.hpp"

#include "marrow/shaft/widths.hpp"

namespace marrow::shaft {
namespace {

constexpr double kEvidencePer_mm = 0.1;  // log-likelihood of a millimetre supported on both sides
constexpr double kPlainStep = 0.8;       // part of the largest step of brightness; fainter pairs are weaker evidence
constexpr double kRidge_mm = 4;  // largest distance of the outline outside a border, at a ridge or other fragment

/// Two nearly parallel lines with opposite gradients.
struct Pair {
  Border left, right;  // left and right when looking along the stretch
  Stretch stretch;
  double width_mm = 0, supported_mm = 0;
  double weight = 1;   // of the evidence; less than 1 if the borders are faint for bone
  double score = 0;    // log-likelihood of width, taper and evidence
  std::string reason;  // why it is not the shaft; empty for a candidate
};

std::string text(const char* format, double a, double b = 0, double c = 0) {
  return formatted(fmt::runtime(format), a, b, c);
}

/// The common direction of two lines: downwards, or to the right if they are nearly horizontal.
Eigen::Vector2d direction_of(const Border& one, const Border& other) {
  const Eigen::Vector2d normal = (one.normal - other.normal).normalized();
  const Eigen::Vector2d direction(-normal.y(), normal.x());
  const bool turn = std::abs(direction.y()) > 0.1 ? direction.y() < 0 : direction.x() < 0;
  return turn ? Eigen::Vector2d(-direction) : direction;
}

/// Distance in mm between the two lines in the middle of their stretch, at the depth of the shaft.
double width_of(const Pair& pair, const Scale& scale) {
  const Eigen::Vector2d& along = pair.stretch.along;
  const double s = 0.5 * (pair.stretch.from + pair.stretch.to);
  return scale.across_mm(point_at(pair.left, along, s) - point_at(pair.right, along, s), along);
}

/// Length in mm of a pair's stretch, at the depth of the shaft.
double length_of(const Pair& pair, const Scale& scale) {
  return pair.stretch.length() * scale.length_mm(pair.stretch.along);
}

/// All that is needed to judge pairs.
struct Scene {
  const EdgeMap& edges;
  const cv::Mat& image;
  const Scale& scale;
  const LineOptions& options;
  Widths widths;
  double bone_step = 0;  // largest step of brightness of a possible pair
};

/// Standard deviation of the width, from the fit and from the unknown depth. Errors of neighbouring edge pixels are
/// correlated.
double width_deviation_of(const Pair& pair, const Scene& scene) {
  constexpr double kSharing_px = 4;
  const auto variance_px = [](const Border& border) {
    return kSharing_px * border.spread_px * border.spread_px / std::max(1, border.pixels);
  };
  const Eigen::Vector2d& along = pair.stretch.along;
  const double across_mm = scene.scale.across_mm({-along.y(), along.x()}, along);
  return std::hypot(across_mm * std::sqrt(variance_px(pair.left) + variance_px(pair.right)),
                    scene.options.magnification_tolerance * pair.width_mm);
}

void score(const Scene& scene, Pair& pair) {
  pair.width_mm = width_of(pair, scene.scale);
  const double taper_deg = degrees(std::acos(std::clamp(-pair.left.normal.dot(pair.right.normal), 0.0, 1.0)));
  pair.score =
      kEvidencePer_mm * pair.weight * pair.supported_mm + scene.widths.log_likelihood(pair.width_mm, taper_deg);
}

/// The reason why a pair is not the shaft, from its edges only; empty if it may be the shaft.
std::string reason_by_edges(const Scene& scene, const Pair& pair, const Eigen::Vector2d& to_left) {
  const double length_mm = length_of(pair, scene.scale);
  if (length_mm < scene.options.min_length_mm)
    return text("its borders run side by side for {:.0f} mm only, of {:.0f} mm wanted", length_mm,
                scene.options.min_length_mm);
  if (pair.left.normal.dot(to_left) < 0)
    return text("it is darker outside than inside, as a canal or a gap between bones is ({:.1f} mm wide)",
                pair.width_mm);
  if (scene.widths.is_possible(pair.width_mm)) return "";
  const bool small = pair.width_mm < scene.widths.least_mm();
  return text("its width of {:.1f} mm is too ", pair.width_mm) + (small ? "small" : "large") + " for a shaft (" +
         scene.widths.range() + "), as " + (small ? "a cable's or a single cortex' is" : "the limb's is");
}

/// Shortens a pair, and its evidence in proportion.
void cut(Pair& pair, const Stretch& part) {
  pair.supported_mm *= part.length() / pair.stretch.length();
  pair.stretch = part;
}

/// The reason why a pair is not the shaft, from its brightness; empty if it may be the shaft. Cuts the stretch to the
/// part in which both borders are steps of brightness.
std::string reason_by_image(const Scene& scene, Pair& pair) {
  const double pixel_mm = scene.scale.pixel_mm;
  const Stretch outer = stretch_at_outline(scene.edges, pair.left, pair.right, scene.scale.support, pair.stretch,
                                           kRidge_mm / pixel_mm, scene.scale.gap_px);
  if (outer.length() >= scene.scale.min_length_px) cut(pair, outer);
  cut(pair, stretch_with_steps(scene.image, pair.left, pair.right, pair.stretch, scene.bone_step, pixel_mm,
                               scene.scale.gap_px));
  const double length_mm = length_of(pair, scene.scale);
  if (length_mm < scene.options.min_length_mm)
    return text(
        "only {:.0f} mm of its borders are clear enough for bone, of {:.0f} mm wanted; muscle's are as faint ({:.1f} "
        "mm wide)",
        length_mm, scene.options.min_length_mm, pair.width_mm);
  const Brightness mean = brightness_of(scene.image, pair.left, pair.right, pair.stretch, pixel_mm);
  if (mean.inside < std::min(mean.outside_left, mean.outside_right)) {
    const double step = step_of(scene.image, pair.left, pair.right, pair.stretch, pixel_mm);
    pair.weight = std::min(1.0, step / (kPlainStep * scene.bone_step));
    return "";
  }
  return text("it is not darker than what lies beside it (mean grey value {:.0f} inside, {:.0f} and {:.0f} outside)",
              mean.inside, mean.outside_left, mean.outside_right);
}

/// Sets stretch, width, score and, from the edges, the reason why the pair is not the shaft.
void judge_edges(const Scene& scene, Pair& pair) {
  const Eigen::Vector2d direction = direction_of(pair.left, pair.right),
                        to_left(direction.y(), -direction.x());  // v runs down
  int supported = 0;
  pair.stretch =
      common_stretch(scene.edges, pair.left, pair.right, scene.scale.support, direction, scene.scale.gap_px, supported);
  pair.supported_mm = supported * scene.scale.length_mm(direction);
  pair.weight = 1;
  const double middle = 0.5 * (pair.stretch.from + pair.stretch.to);
  if (to_left.dot(point_at(pair.left, direction, middle) - point_at(pair.right, direction, middle)) < 0)
    std::swap(pair.left, pair.right);
  score(scene, pair);
  pair.reason = reason_by_edges(scene, pair, to_left);
}

/// The same from the image, for a pair that passed judge_edges().
void judge_image(const Scene& scene, Pair& pair) {
  if (!pair.reason.empty()) return;
  Pair part = pair;
  pair.reason = reason_by_image(scene, part);
  if (!pair.reason.empty()) return;  // reports show the stretch from the edges
  score(scene, part);
  pair = part;
  if (pair.score < scene.options.least_log_likelihood)
    pair.reason = text("its log-likelihood of {:.1f} is below {:.1f}, the least that is taken ({:.1f} mm wide)",
                       pair.score, scene.options.least_log_likelihood, pair.width_mm);
}

/// Sorts pairs: candidates before rejected pairs, each group by falling score.
void sort_by_score(std::vector<Pair>& pairs) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.reason.empty() != b.reason.empty() ? a.reason.empty() : a.score > b.score;
  });
}

/// All nearly parallel pairs with opposite gradients, judged and sorted. Sets bone_step.
std::vector<Pair> pairs_of(Scene& scene, const std::vector<Border>& borders) {
  std::vector<Pair> pairs;
  const double cosine = std::cos(radians(scene.options.max_angle_deg));
  for (std::size_t i = 0; i < borders.size(); ++i)
    for (std::size_t j = i + 1; j < borders.size(); ++j) {
      if (-borders[i].normal.dot(borders[j].normal) < cosine) continue;
      Pair pair;
      pair.left = borders[i];
      pair.right = borders[j];
      judge_edges(scene, pair);
      if (pair.supported_mm > 0.2 * scene.options.min_length_mm) pairs.push_back(std::move(pair));
    }
  for (const Pair& pair : pairs)
    if (pair.reason.empty())
      scene.bone_step =
          std::max(scene.bone_step, step_of(scene.image, pair.left, pair.right, pair.stretch, scene.scale.pixel_mm));
  for (Pair& pair : pairs) judge_image(scene, pair);
  sort_by_score(pairs);
  return pairs;
}

/// Fits both borders again over their common stretch, three times, so that both describe the same piece of the bone.
Pair settled(const Scene& scene, Pair pair) {
  for (int round = 0; round < 3 && pair.reason.empty(); ++round) {
    pair.left = refit(scene.edges, pair.left, scene.scale.support, pair.stretch, 0);
    pair.right = refit(scene.edges, pair.right, scene.scale.support, pair.stretch, 0);
    if (pair.left.pixels == 0 || pair.right.pixels == 0)
      pair.reason = "a border loses its edge pixels when it is fitted again";
    else
      judge_edges(scene, pair), judge_image(scene, pair);
  }
  return pair;
}

/// Whether both pairs show the same piece of shaft: their middles are close to each other over at least half of the
/// shorter one. A curved border has many lines; their pairs would displace the shaft of another fragment from the list.
bool same_shaft(const Pair& a, const Pair& b) {
  const auto middle = [](const Pair& pair, const Eigen::Vector2d& along, double s) -> Eigen::Vector2d {
    return 0.5 * (point_at(pair.left, along, s) + point_at(pair.right, along, s));
  };
  const Eigen::Vector2d& along = a.stretch.along;
  const double one = along.dot(middle(b, b.stretch.along, b.stretch.from)),
               other = along.dot(middle(b, b.stretch.along, b.stretch.to));
  const double from = std::max(a.stretch.from, std::min(one, other)), to = std::min(a.stretch.to, std::max(one, other));
  if (to - from < 0.5 * std::min(a.stretch.length(), std::abs(other - one))) return false;
  const double s = 0.5 * (from + to);
  const double width = (point_at(a.left, along, s) - point_at(a.right, along, s)).norm();
  return (middle(a, along, s) - middle(b, along, s)).norm() < 0.05 * width;
}

/// Moves the borders from the edges to the outline. If the distance is known for only one border, it is used for both,
/// because the blur is the same.
void move_to_outline(const Scene& scene, Pair& pair) {
  const auto beyond_px = [&](const Border& border) {
    return outline_beyond_edges_px(scene.image, scene.edges, border, scene.scale.support, pair.stretch,
                                   pair.width_mm / scene.scale.pixel_mm, scene.scale.pixel_mm);
  };
  const std::optional<double> left = beyond_px(pair.left), right = beyond_px(pair.right);
  pair.left.rho += left.value_or(right.value_or(0));
  pair.right.rho += right.value_or(left.value_or(0));
  pair.width_mm = width_of(pair, scene.scale);
}

LineSegment segment_of(const Border& border, const Stretch& stretch) {
  return {point_at(border, stretch.along, stretch.from), point_at(border, stretch.along, stretch.to)};
}

[[noreturn]] void refuse(const View& view, const std::vector<Border>& borders, const std::vector<Pair>& pairs) {
  std::string message = formatted("view '{}': no shaft pair found: {} lines", view.name, borders.size());
  if (pairs.empty()) message += ", none of which run side by side";
  for (std::size_t i = 0; i < std::min<std::size_t>(pairs.size(), 3); ++i)
    message += (i ? "; the next because " : ", best candidate rejected because ") + pairs[i].reason;
  throw Error(message + "; look at the edges, and set the edge detector's thresholds or this bone's width_mm");
}

}  // namespace

ShaftLines best_pair(const EdgeMap& edges, const View& view, const std::vector<Border>& borders, const Scale& scale,
                     const LineOptions& options) {
  Scene scene{edges,
              view.image.pixels,
              scale,
              options,
              Widths(options.width_mm, options.width_deviation_mm, options.magnification_tolerance),
              0};
  std::vector<Pair> pairs = pairs_of(scene, borders);
  for (std::size_t i = 0; i < std::min<std::size_t>(pairs.size(), 6); ++i)
    if (pairs[i].reason.empty()) pairs[i] = settled(scene, pairs[i]);
  sort_by_score(pairs);
  if (pairs.empty() || !pairs[0].reason.empty()) refuse(view, borders, pairs);
  if (options.outline) move_to_outline(scene, pairs[0]);
  ShaftLines lines;
  lines.left = segment_of(pairs[0].left, pairs[0].stretch);
  lines.right = segment_of(pairs[0].right, pairs[0].stretch);
  lines.width_mm = pairs[0].width_mm;
  lines.width_deviation_mm = width_deviation_of(pairs[0], scene);
  lines.log_likelihood = pairs[0].score;
  std::vector<const Pair*> shafts{&pairs[0]};
  for (std::size_t i = 1; i < pairs.size() && lines.rejected.size() < 20; ++i) {
    if (pairs[i].reason.empty()) {
      if (std::any_of(shafts.begin(), shafts.end(), [&](const Pair* better) { return same_shaft(*better, pairs[i]); }))
        continue;
      shafts.push_back(&pairs[i]);
      pairs[i].reason = text("its log-likelihood of {:.1f} is below the best one's {:.1f} ({:.1f} mm wide)",
                             pairs[i].score, pairs[0].score, pairs[i].width_mm);
    }
    lines.rejected.push_back(
        {segment_of(pairs[i].left, pairs[i].stretch), segment_of(pairs[i].right, pairs[i].stretch), pairs[i].reason});
  }
  return lines;
}

namespace {

void check_inputs(const EdgeMap& edges, const View& view) {
  check_view(view);
  const std::string what = "view '" + view.name + "': ";
  const int type = view.image.pixels.type();
  if (type != CV_8UC1 && type != CV_16UC1 && type != CV_32FC1)
    throw Error(what + "the image must have one channel of 8 or 16 bit whole numbers or 32 bit floats");
  if (edges.width_px != view.camera.width_px || edges.height_px != view.camera.height_px)
    throw Error(formatted("{}the edge map is for {} x {} pixels, the view has {} x {}; wire the edges of this view",
                          what, edges.width_px, edges.height_px, view.camera.width_px, view.camera.height_px));
  if (edges.pixels.empty())
    throw Error(what +
                "the edge map is empty, so there is no shaft in it; look at the image, and lower the thresholds of the "
                "edge detector");
  for (const EdgePixel& edge : edges.pixels)
    if (!std::isfinite(edge.u_px) || !std::isfinite(edge.v_px) || !std::isfinite(edge.direction_u) ||
        !std::isfinite(edge.direction_v))
      throw Error(what + "the edge map holds numbers that are not finite (NaN or infinity); look at the edge detector");
}

/// A point on the central ray of a view, at the depth of the shaft.
Eigen::Vector3d place_of_shaft(const View& view, const List<View>* views, const LineOptions& options,
                               Context& context) {
  constexpr double kUsual_mm = 600;
  if (!(options.source_to_shaft_mm > 0) && views)
    if (const auto meeting_mm = meeting_point_mm(*views)) return *meeting_mm;
  if (!(options.source_to_shaft_mm > 0))
    context.warn("view '" + view.name +
                 "': how far the shaft is from the X-ray source is not known; 600 mm are assumed, and all its lengths "
                 "in mm depend on this. Wire 'views' with two views or more, or set source_to_shaft_mm");
  const double depth_mm = options.source_to_shaft_mm > 0 ? options.source_to_shaft_mm : kUsual_mm;
  return source_position_mm(view.camera) + depth_mm * view.camera.camera_from_world.rotation.row(2).transpose();
}

/// Whether two borders are the same line: similar directions, and close to each other at the middle of the image.
bool same_line(const Border& one, const Border& other, const Eigen::Vector2d& middle, double tolerance_px) {
  const Eigen::Vector2d direction = along(one);
  const double s = direction.dot(middle);
  return other.normal.dot(one.normal) > std::cos(radians(1)) &&
         (point_at(other, direction, s) - point_at(one, direction, s)).norm() < tolerance_px;
}

}  // namespace

double Scale::across_mm(const Eigen::Vector2d& offset_px, const Eigen::Vector2d& along_px) const {
  const Eigen::Vector2d offset = mm_from_px * offset_px, along = (mm_from_px * along_px).normalized();
  return std::abs(along.x() * offset.y() - along.y() * offset.x());
}

Scale checked_scale(const EdgeMap& edges, const View& view, const List<View>* views, const LineOptions& options,
                    Context& context) {
  check_inputs(edges, view);
  const Eigen::Vector3d shaft_mm = place_of_shaft(view, views, options, context);
  Scale scale;
  scale.pixel_mm = pixel_size_at_mm(view.camera, shaft_mm);
  scale.mm_from_px.col(0) = offset_at_mm(view.camera, shaft_mm, Eigen::Vector2d::UnitX());
  scale.mm_from_px.col(1) = offset_at_mm(view.camera, shaft_mm, Eigen::Vector2d::UnitY());
  scale.min_length_px = options.min_length_mm / scale.pixel_mm;
  scale.gap_px = options.gap_mm / scale.pixel_mm;
  scale.support = {options.tolerance_mm / scale.pixel_mm, std::cos(radians(15))};
  return scale;
}

std::vector<Border> supported_lines(const EdgeMap& edges, const std::vector<Border>& candidates, const Scale& scale,
                                    const LineOptions& options) {
  const Eigen::Vector2d middle(0.5 * edges.width_px, 0.5 * edges.height_px);
  std::vector<Border> borders;
  for (Border border : candidates) {
    if (int(borders.size()) == options.lines) break;
    border.pixels = 1;
    for (int round = 0; round < 2 && border.pixels > 0; ++round) {
      Stretch run;
      run.along = along(border);
      std::tie(run.from, run.to) =
          longest_run(supported_positions(edges, border, scale.support, run.along), scale.gap_px);
      border = run.length() < 0.5 * scale.min_length_px ? Border{} : refit(edges, border, scale.support, run, 2);
    }
    const auto same = [&](const Border& other) {
      return same_line(border, other, middle, 0.3 * scale.support.tolerance_px);
    };
    if (border.pixels > 0 && std::none_of(borders.begin(), borders.end(), same)) borders.push_back(border);
  }
  return borders;
}

}  // namespace marrow::shaft
