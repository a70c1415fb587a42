// SPDX-License-Identifier: Apache-2.0
// The misalignment of a broken bone in the terms of surgeons. All figures are of the distal fragment relative to the
// proximal one, compared with the CT, which shows both in place.
#include <marrow/plugin.hpp>

#include "marrow/fracture/fracture_site.hpp"
#include "marrow/toolbox/geometry/fragments.hpp"

namespace {

using namespace marrow;

struct Options : geometry::FragmentPair {
  std::string side = "unknown";
  Eigen::Vector3d front{0, -1, 0};
  Eigen::Vector3d up{0, 0, 1};
  std::vector<double> fracture_mm;
};

/// A signed figure, with the words for both signs.
struct Figure {
  const char* name;
  double value;
  const char* unit;
  const char* positive;
  const char* negative;
};

/// The patient's directions in the CT as columns: left, back, and up along `shaft`.
Eigen::Matrix3d directions(const Eigen::Vector3d& shaft, const Options& options) {
  constexpr double kLeastSine = 0.17;  // 10 degrees
  const Eigen::Vector3d left = options.up.cross(options.front);
  if (!(left.norm() > kLeastSine * options.up.norm() * options.front.norm()) || !left.allFinite())
    throw Error("'front' and 'up' must be two different directions of the CT, such as [0, -1, 0] and [0, 0, 1]");
  Eigen::Matrix3d axes;
  axes.col(2) = shaft.dot(options.up) < 0 ? Eigen::Vector3d(-shaft) : shaft;
  const Eigen::Vector3d across = left.normalized() - axes.col(2) * axes.col(2).dot(left.normalized());
  if (!(across.norm() > kLeastSine))
    throw Error(
        "the bone's long axis runs from the patient's left to the right in the CT, so its frontal plane is not known; "
        "give the 'front' and 'up' of this limb in the CT");
  axes.col(0) = across.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

/// The distal fragment's long axis in the CT. The long axis of a fragment that is shorter than wide does not run along
/// the bone. Then the axes of the two fragments differ, and the one nearer to `up` is taken.
Eigen::Vector3d shaft_of(const FragmentFrame& distal, const FragmentFrame& proximal, const Options& options,
                         const Context& context) {
  constexpr double kMostApart_deg = 30;
  const Eigen::Vector3d one = distal.axes.col(2), other = proximal.axes.col(2);
  const double apart_deg = degrees(std::acos(std::min(1.0, std::abs(one.dot(other)))));
  if (apart_deg <= kMostApart_deg) return one;
  const bool takes_distal = std::abs(one.dot(options.up)) > std::abs(other.dot(options.up));
  context.warn(
      formatted("the long axes of the two fragments differ by {:.0f} degrees in the CT, so one fragment is too short "
                "to show the bone's axis; the {} one is taken, whose axis is nearer to 'up'",
                apart_deg, takes_distal ? "distal" : "proximal"));
  return takes_distal ? one : other;
}

Eigen::Vector3d fracture_in_ct_mm(const List<Mesh>* models, const Options& options) {
  if (!options.fracture_mm.empty()) {
    if (options.fracture_mm.size() != 3)
      throw Error(formatted("'fracture_mm' takes one point of the CT, as [x, y, z], got {} numbers",
                            options.fracture_mm.size()));
    return Eigen::Vector3d::Map(options.fracture_mm.data());
  }
  const Mesh *moved = models ? models->find(options.moved) : nullptr,
             *reference = models ? models->find(options.reference) : nullptr;
  if (!moved || !reference)
    throw Error(
        "where the fracture is in the CT is not known, so there is no shift and no shortening; wire the surfaces of "
        "both fragments to 'models', or give the fracture's middle as 'fracture_mm'");
  return fracture::middle_of_fracture_mm(*moved, options.moved, *reference, options.reference);
}

/// `motion`: of the distal fragment, in the CT, from its place beside the proximal one. It is split into a twist about
/// the long axis and a swing, which then turns this axis to its present direction.
std::vector<Figure> figures_of(const RigidTransform& motion, const Eigen::Matrix3d& axes,
                               const Eigen::Vector3d& fracture_mm, const std::string& side) {
  const Eigen::Matrix3d turn = axes.transpose() * motion.rotation * axes;
  const Eigen::Vector3d shaft = turn.col(2), shift = axes.transpose() * (motion * fracture_mm - fracture_mm);
  const Eigen::Quaterniond whole(turn);
  const double to_left = std::atan2(shaft.x(), shaft.z()), to_back = std::atan2(shaft.y(), shaft.z()),
               twist = std::remainder(2 * std::atan2(whole.z(), whole.w()), 2 * kPi);
  // The upper end that tilts to the left leaves the apex on the left. For a left limb, left is lateral.
  const double lateral = side == "right" ? -1 : 1;
  const bool is_known = side != "unknown";
  return {
      {is_known ? "varus_deg" : "apex_left_deg", lateral * degrees(to_left), "deg",
       is_known ? "varus" : "apex to the patient's left", is_known ? "valgus" : "apex to the patient's right"},
      {"procurvatum_deg", -degrees(to_back), "deg", "procurvatum (apex to the front)", "recurvatum (apex to the back)"},
      {is_known ? "internal_torsion_deg" : "torsion_left_deg", (is_known ? -lateral : 1) * degrees(twist), "deg",
       is_known ? "internal torsion" : "torsion to the patient's left",
       is_known ? "external torsion" : "torsion to the patient's right"},
      {is_known ? "medial_shift_mm" : "left_shift_mm", (is_known ? -lateral : 1) * shift.x(), "mm",
       is_known ? "medial shift" : "shift to the patient's left",
       is_known ? "lateral shift" : "shift to the patient's right"},
      {"anterior_shift_mm", -shift.y(), "mm", "shift to the front", "shift to the back"},
      {"shortening_mm", shift.z(), "mm", "shortening", "lengthening"}};
}

/// Figures that would be shown as 0.0 are left out.
std::string in_words(const std::vector<Figure>& figures) {
  std::string text;
  for (const Figure& figure : figures)
    if (std::abs(figure.value) >= 0.05)
      text += (text.empty() ? "" : ", ") + formatted("{:.1f} {} {}", std::abs(figure.value), figure.unit,
                                                     figure.value < 0 ? figure.negative : figure.positive);
  return "the distal fragment beside the proximal one: " + (text.empty() ? "in place" : text);
}

Metrics misalignment(const List<Pose>& poses, const List<Mesh>* models, const Options& options, Context& context) {
  const geometry::PosesOfPair pair = geometry::poses_of_pair(poses, options, models);
  const bool moved_is_below =
      options.up.dot(pair.moved.frame.origin_mm) < options.up.dot(pair.reference.frame.origin_mm);
  const Pose &distal = moved_is_below ? pair.moved : pair.reference,
             &proximal = moved_is_below ? pair.reference : pair.moved;
  const RigidTransform motion = inverse(proximal.world_from_model) * distal.world_from_model;
  const Eigen::Matrix3d axes = directions(shaft_of(distal.frame, proximal.frame, options, context), options);
  const std::vector<Figure> figures = figures_of(motion, axes, fracture_in_ct_mm(models, options), options.side);
  context.info(in_words(figures));
  const Eigen::Vector3d shaft = axes.transpose() * motion.rotation * axes.col(2);
  Metrics metrics;
  metrics.items = {{"angulation_deg", degrees(std::atan2(shaft.head<2>().norm(), shaft.z())), "deg"},
                   {"shift_mm", std::hypot(figures[3].value, figures[4].value), "mm"}};
  for (const Figure& figure : figures) metrics.items.push_back({figure.name, figure.value, figure.unit});
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("fracture.misalignment", misalignment)
      .summary(
          "Angulation, torsion, shift and shortening at a fracture: the distal fragment relative to the proximal one, "
          "compared with the CT, where both are in place")
      .in("poses", "poses of both fragments", over("fragment"))
      .in("models", "surfaces of both fragments in the CT: they show where the fracture is", over("fragment"))
      .out("metrics",
           "angle between the long axes, and its parts in the frontal plane (positive: varus) and in the sagittal "
           "plane (positive: procurvatum, apex to the front); internal torsion, about the long axis; shift of the "
           "fracture's faces across it, its medial and anterior parts; shortening. If the side is not known, varus, "
           "internal and medial are replaced by the patient's left: apex_left_deg, torsion_left_deg, left_shift_mm")
      .figures({"angulation_deg", "shift_mm", "varus_deg", "apex_left_deg", "procurvatum_deg", "internal_torsion_deg",
                "torsion_left_deg", "medial_shift_mm", "left_shift_mm", "anterior_shift_mm", "shortening_mm"})
      .option("moved", &Options::moved, "one fragment; the one that is lower in the CT is the distal one")
      .option("reference", &Options::reference, "the other fragment")
      .option("side", &Options::side,
              "side of the limb; it tells medial from lateral, varus from valgus, internal from external torsion",
              one_of({"unknown", "left", "right"}))
      .option("front", &Options::front, "direction to the front of the limb in the CT", unit(""))
      .option("up", &Options::up, "direction in the CT from the limb's end to the trunk", unit(""))
      .option("fracture_mm", &Options::fracture_mm,
              "middle of the fracture in the CT, [x, y, z]; empty: half way between the faces of the two surfaces");
}
