// SPDX-License-Identifier: Apache-2.0
// Corrects predicted deviations. A covariance is predicted from residuals, which miss some errors, such as that of the
// segmentation, and count others twice. So the deviation about and along each axis is multiplied by a factor that was
// fitted to bones whose true pose is known (tools/studies/deviations --fit).
#include <array>
#include <marrow/plugin.hpp>

namespace {

using Factors = std::array<double, 3>;

struct Options {
  Factors rotation_factors{1, 1, 1}, translation_factors{1, 1, 1};
  Factors first_rotation_factors{1, 1, 1}, first_translation_factors{1, 1, 1};
};

struct Result {
  marrow::Pose pose;
  marrow::List<marrow::Pose> stages;
};

marrow::Pose scaled(const marrow::Pose& pose, const marrow::FragmentFrame& axes, const Factors& rotation,
                    const Factors& translation) {
  if (!pose.covariance || !pose.covariance->allFinite()) return pose;
  marrow::Vector6d factors;
  factors << rotation[0], rotation[1], rotation[2], translation[0], translation[1], translation[2];
  marrow::Pose along_axes = in_frame(pose, axes);
  marrow::Matrix6d& covariance = along_axes.covariance.value();
  covariance = factors.asDiagonal() * covariance * factors.asDiagonal();
  return in_frame(along_axes, pose.frame);
}

/// Adds what the covariance of the same pose grew by.
void add_growth(const marrow::Pose& from, const marrow::Pose& to, marrow::Pose& pose) {
  if (!from.covariance || !to.covariance || !pose.covariance) return;
  const marrow::Matrix6d growth = *in_frame(to, pose.frame).covariance - *in_frame(from, pose.frame).covariance;
  if (growth.allFinite()) *pose.covariance += growth;
}

Result calibrated(const marrow::List<marrow::Pose>& stages, const marrow::List<marrow::Pose>* widened,
                  const marrow::Mesh& model, const Options& options) {
  if (stages.empty()) throw marrow::Error("there is no pose; wire the stages of a registration");
  if (widened && widened->names() != stages.names())
    throw marrow::Error("widened and stages are not the same poses; wire the stages of the node that got these stages");
  marrow::check_mesh(model, "model");
  const marrow::FragmentFrame axes = marrow::fragment_frame(model);
  Result result;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    check_pose(stages[i], "the pose of stage '" + stages.name(i) + "'");
    const bool is_first = stages.name(i) == "first" && i + 1 < stages.size();
    marrow::Pose pose = scaled(stages[i], axes, is_first ? options.first_rotation_factors : options.rotation_factors,
                               is_first ? options.first_translation_factors : options.translation_factors);
    if (widened) add_growth(stages[i], (*widened)[i], pose);
    result.stages.add(stages.name(i), pose);
  }
  result.pose = result.stages[result.stages.size() - 1];
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("deviations.calibrated", calibrated)
      .summary("Multiplies the predicted deviations of poses by factors that were fitted to known errors")
      .in("stages",
          "poses of a search; 'first' is the result of the first cost (register.sequence), unless it is the last pose",
          marrow::over("stage"))
      .in("widened",
          "the same poses with what the cameras add (deviations.cameras); this part is added, not multiplied",
          marrow::over("stage"))
      .in("model", "surface of the bone; it gives the axes")
      .out("pose", &Result::pose, "the last pose; a covariance that is absent or not finite stays as it is")
      .out("stages", &Result::stages, "all poses", marrow::over("stage"))
      .option("rotation_factors", &Options::rotation_factors,
              "factors of the deviations about the frontal, lateral and long axes", marrow::at_least(0.01),
              marrow::at_most(100))
      .option("translation_factors", &Options::translation_factors,
              "factors of the deviations along the frontal, lateral and long axes", marrow::at_least(0.01),
              marrow::at_most(100))
      .option("first_rotation_factors", &Options::first_rotation_factors, "the same for 'first', about the axes",
              marrow::at_least(0.01), marrow::at_most(100))
      .option("first_translation_factors", &Options::first_translation_factors, "the same for 'first', along the axes",
              marrow::at_least(0.01), marrow::at_most(100));
}
