// SPDX-License-Identifier: Apache-2.0
#pragma once
// Functions that travel along the edges of a pipeline as values: projectors, costs, optimizers. All methods are
// const and safe to call from several threads at once. A function may refer to the inputs of the node that made it: the
// runtime keeps those alive as long as the function.
#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/pose.hpp"

namespace marrow {

/// One point of a projected outline: position in the image and the unit normal that points away from the bone, and the
/// surface point that it is the image of.
struct OutlinePoint {
  float u_px = 0, v_px = 0;
  float normal_u = 0, normal_v = 0;
  Eigen::Vector3f model_mm = Eigen::Vector3f::Zero();
};

/// Pixels in rows and columns, the first at (u_px, v_px), step_px apart: a region of an image, sub-sampled or not.
struct PixelGrid {
  double u_px = 0, v_px = 0, step_px = 1;
  int columns = 0, rows = 0;

  std::size_t count() const { return columns > 0 && rows > 0 ? std::size_t(columns) * std::size_t(rows) : 0; }
  Eigen::Vector2d pixel(int column, int row) const { return {u_px + step_px * column, v_px + step_px * row}; }
};

/// Draws the outline of a model as a view would see it.
class OutlineProjector {
 public:
  virtual ~OutlineProjector();
  /// The outline of the model in the camera's image, about one point every `spacing_px`, inside the image only, in a
  /// fixed order. Parts that are made by the end of the CT volume and not by the bone are left out. May be empty.
  virtual std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& world_from_model,
                                            double spacing_px) const = 0;
};

/// Makes radiographs (DRR) of a model as a view would see it.
class RadiographProjector {
 public:
  virtual ~RadiographProjector();
  /// Line integrals of the attenuation along the rays through these pixels, row by row, relative to water: millimetres
  /// of water that attenuate as much. 0 where a ray misses the model. Only what is asked for is computed.
  virtual std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                        const PixelGrid& grid) const = 0;
  /// The same for single pixels (u, v), in their order.
  virtual std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                        const std::vector<Eigen::Vector2f>& pixels) const = 0;
  /// Whole pixels outside of which radiograph() is 0, cut to the image; empty where the model is out of view.
  virtual PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const = 0;
};

/// How finely a cost looks: the spacing of outline points (the chapter's contour sub-sampling) and the distance beyond
/// which a point counts as unmatched; of grey values, every how many pixels they are compared, 0 = as the cost was
/// made.
struct CostLevel {
  double contour_spacing_px = 1;
  double reach_px = 8;
  int pixel_step = 0;
};

/// How badly a pose explains the images; smaller is better.
class Cost {
 public:
  /// value + gradient . m + m . curvature m / 2 for a small motion m = (r [rad], t [mm]); the curvature has no negative
  /// eigenvalue (Gauss and Newton's of a sum of squares).
  struct Expansion {
    double value = 0;
    Vector6d gradient = Vector6d::Zero();
    Matrix6d curvature = Matrix6d::Zero();
  };

  virtual ~Cost();
  /// The cost at a pose. Finite for every finite pose: where nothing can be compared it is the worst value.
  virtual double value(const RigidTransform& world_from_model) const = 0;
  /// The costs of many poses, in their order; the default evaluates them in parallel.
  virtual std::vector<double> values(const std::vector<RigidTransform>& world_from_model) const;
  /// The same cost at another resolution.
  virtual std::shared_ptr<const Cost> at_level(const CostLevel& level) const = 0;
  /// The cost about a pose, for small motions of the fragment about this frame as Pose defines them; for optimizers
  /// that use derivatives. It takes about as long as one value(). Absent where the cost does not know its derivatives,
  /// as by default.
  virtual std::optional<Expansion> expansion(const RigidTransform& world_from_model, const FragmentFrame& frame) const;
  /// Factor that makes value() a negative log-likelihood near this pose: the inverse of (factor * Hessian) then
  /// predicts the covariance of the minimum. Absent where the cost has no noise model.
  virtual std::optional<double> likelihood_factor(const RigidTransform& world_from_model) const;
};

/// A function R^n -> R to be minimised, knowing nothing of poses.
struct MinimisationProblem {
  std::function<double(const Eigen::VectorXd&)> function;
  /// value + gradient . d + d . curvature d / 2 about a point, where the function knows its derivatives; the curvature
  /// has no negative eigenvalue. May be empty. One call counts as one evaluation.
  struct Expansion {
    double value = 0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd curvature;
  };
  std::function<Expansion(const Eigen::VectorXd&)> expansion;
  Eigen::VectorXd start;
  Eigen::VectorXd initial_step;  ///< positive, per coordinate
  Eigen::VectorXd lower, upper;  ///< empty = unbounded
  int max_evaluations = 1000;
  double step_tolerance = 1e-4;  ///< stop when steps fall below this fraction of initial_step
  std::function<void(int evaluation, const Eigen::VectorXd&, double value)> observer;  ///< may be empty
};
struct MinimisationResult {
  Eigen::VectorXd x;
  double value = 0;
  int evaluations = 0;
  std::string stopped_because;
};

class Optimizer {
 public:
  virtual ~Optimizer();
  /// The best point found. A function value that is not finite counts as the worst; exceptions of the function pass
  /// through.
  virtual MinimisationResult minimise(const MinimisationProblem& problem) const = 0;
};

}  // namespace marrow
