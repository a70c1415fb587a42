// SPDX-License-Identifier: Apache-2.0
#pragma once
// Functions that a pipeline passes between nodes as values: projectors, costs, optimizers. All methods are const and
// safe to call from several threads at once. A function may refer to the inputs of the node that made it: the runtime
// keeps these inputs alive as long as the function.
#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/pose.hpp"

namespace MARROW_EXPORT marrow {

/// One point of a projected outline: its position in the image, the unit normal that points away from the bone, and the
/// point of the model's surface that it shows.
struct OutlinePoint {
  float u_px = 0, v_px = 0;
  float normal_u = 0, normal_v = 0;
  Eigen::Vector3f model_mm = Eigen::Vector3f::Zero();
};

/// A grid of pixels: a region of an image at full resolution or sub-sampled. The first pixel is at (u_px, v_px), and
/// neighbours are step_px apart.
struct PixelGrid {
  double u_px = 0, v_px = 0, step_px = 1;
  int columns = 0, rows = 0;

  std::size_t count() const { return columns > 0 && rows > 0 ? std::size_t(columns) * std::size_t(rows) : 0; }
  Eigen::Vector2d pixel(int column, int row) const { return {u_px + step_px * column, v_px + step_px * row}; }
};

/// Computes the outline of a model as a view would see it.
class OutlineProjector {
 public:
  virtual ~OutlineProjector();
  /// The outline of the model in the camera's image: about one point every `spacing_px`, in a fixed order, only inside
  /// the image. Leaves out edges that the end of the CT volume makes, because they are not bone. May be empty.
  virtual std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& world_from_model,
                                            double spacing_px) const = 0;
};

/// A radiograph and how each of its pixels changes when the model moves.
struct RadiographExpansion {
  std::vector<float> values;  ///< as RadiographProjector::radiograph() gives them
  /// The derivative of each pixel by a small motion m = (r [rad], t [mm]) of the model as defined at Pose: one image
  /// for each of the six. In mm of water per radian, and in mm of water per mm.
  std::array<std::vector<float>, 6> slopes;
};

/// Computes digitally reconstructed radiographs (DRRs) of a model as a view would see it.
class RadiographProjector {
 public:
  virtual ~RadiographProjector();
  /// Line integrals of the attenuation along the rays through these pixels, row by row. The unit is mm of water with
  /// the same attenuation. 0 for a ray that misses the model. Only these pixels are computed.
  virtual std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                        const PixelGrid& grid) const = 0;
  /// The same for single pixels (u, v), in the given order.
  virtual std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                        const std::vector<Eigen::Vector2f>& pixels) const = 0;
  /// The radiograph at the pixels of a grid, and its derivatives by a small motion of the model in `frame`. They are
  /// those of the values that are computed, not of the exact line integrals. The call takes about as long as three
  /// radiographs. Absent if the projector knows no derivatives, which is the default.
  virtual std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                                       const FragmentFrame& frame, const PixelGrid& grid) const;
  /// A region of whole pixels, cut to the image, outside of which radiograph() is 0. Empty if the model is out of view.
  virtual PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const = 0;
  /// A projector of the same model, smoothed by a Gaussian of this standard deviation: for radiographs that are
  /// compared with a smoothed image, or computed at few pixels. Null if the projector has none, which is the default.
  virtual std::shared_ptr<const RadiographProjector> smoothed(double sigma_mm) const;
};

/// The resolution of a cost. For outlines: the spacing of their points (the chapter's contour sub-sampling) and the
/// distance beyond which a point counts as unmatched. For grey values: every `pixel_step`-th pixel is compared; 0 means
/// the step that the cost was made with.
struct CostLevel {
  double contour_spacing_px = 1;
  double reach_px = 8;
  int pixel_step = 0;
};

/// How badly a pose explains the images. Smaller is better.
class Cost {
 public:
  /// Quadratic model of the cost for a small motion m = (r [rad], t [mm]): value + gradient . m + m . curvature m / 2.
  /// The curvature has no negative eigenvalue (Gauss-Newton approximation of a sum of squares).
  struct Expansion {
    double value = 0;
    Vector6d gradient = Vector6d::Zero();
    Matrix6d curvature = Matrix6d::Zero();
  };

  virtual ~Cost();
  /// The cost at a pose. It is finite for every finite pose: if nothing can be compared, it is the worst value.
  virtual double value(const RigidTransform& world_from_model) const = 0;
  /// The costs of many poses, in their order. The default calls value() in parallel.
  virtual std::vector<double> values(const std::vector<RigidTransform>& world_from_model) const;
  /// The same cost at another resolution.
  virtual std::shared_ptr<const Cost> at_level(const CostLevel& level) const = 0;
  /// The quadratic model of the cost at a pose, for optimizers that use derivatives. The motion is a small motion in
  /// `frame` as defined at Pose. The call takes about as long as one value(). Absent if the cost has no derivatives,
  /// which is the default.
  virtual std::optional<Expansion> expansion(const RigidTransform& world_from_model, const FragmentFrame& frame) const;
  /// The cost at a pose with each block of the images left out in turn. Blocks are squares of the views' images. They
  /// are the same at every pose, in the same order. A block without effect gives value(). The shifts of the minimum
  /// without single blocks show its uncertainty (delete-a-group jackknife: Shao and Tu, The Jackknife and Bootstrap,
  /// 1995). Empty, the default, if the cost does not support this.
  virtual std::vector<double> without_each_block(const RigidTransform& world_from_model) const;
  /// The quadratic model of the cost at a pose with each block left out in turn, all in one call. Blocks may be larger
  /// here than in without_each_block(). The curvature is that of the cost itself with fixed matches. It may differ from
  /// that of expansion(), which serves a search. Empty, the default, if the cost does not support this.
  virtual std::vector<Expansion> expansion_without_each_block(const RigidTransform& world_from_model,
                                                              const FragmentFrame& frame) const;
  /// The number of views that the cost compares; 0, the default, if it cannot be split into views.
  virtual std::size_t view_count() const;
  /// The cost of a pose in one view alone, with view < view_count(). It has the range of value().
  virtual double value_in_view(std::size_t view, const RigidTransform& world_from_model) const;
  /// Why the images say nothing about this pose, such as "the outline is empty in all views"; empty if something was
  /// compared. A pose about which the images say nothing is not a result. The default is empty, so callers also check
  /// that the cost varies around the pose.
  virtual std::string nothing_compared(const RigidTransform& world_from_model) const;
  /// A sentence for each view that says nothing about this pose, such as "view 'lateral': the mask hides the whole
  /// outline". Empty, the default, if each view says something or the cost does not support this.
  virtual std::vector<std::string> silent_views(const RigidTransform& world_from_model) const;
};

/// A function R^n -> R to minimise. It knows nothing about poses.
struct MinimisationProblem {
  std::function<double(const Eigen::VectorXd&)> function;
  /// Quadratic model about a point: value + gradient . d + d . curvature d / 2. The curvature has no negative
  /// eigenvalue.
  struct Expansion {
    double value = 0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd curvature;
  };
  /// Empty if the function has no derivatives. One call counts as one evaluation.
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
  /// Returns the best point found. A function value that is not finite counts as the worst. Throws Error if the problem
  /// has no coordinates, if a step or the tolerance is not positive and finite, if the bounds exclude the start, or if
  /// no value is finite. Exceptions of the function pass through.
  virtual MinimisationResult minimise(const MinimisationProblem& problem) const = 0;
};

}  // namespace marrow
