// SPDX-License-Identifier: Apache-2.0
#include <deque>
#include <marrow/plugin.hpp>
#include <string>

#include "marrow/optimizer/evaluations.hpp"

namespace {

constexpr std::size_t kMemory = 8;

/// The gradient: from the function itself if it has derivatives, else by central differences with step h, cut at the
/// bounds (2 n evaluations). 0 along a variable whose bounds are equal.
Eigen::VectorXd gradient_at(marrow::optimizer::Evaluations& evaluate, const Eigen::VectorXd& y, double h) {
  if (evaluate.has_derivatives())
    if (const auto about = evaluate.expansion(y)) return about->gradient;
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    Eigen::VectorXd low = y, high = y;
    low[i] -= h;
    high[i] += h;
    low = evaluate.within(low);
    high = evaluate.within(high);
    if (high[i] > low[i]) gradient[i] = (evaluate(high) - evaluate(low)) / (high[i] - low[i]);
  }
  return gradient;
}

/// The function's curvature as estimated from the last steps (Liu and Nocedal, Mathematical Programming 1989).
class Memory {
 public:
  void add(const Eigen::VectorXd& step, const Eigen::VectorXd& change_of_gradient) {
    const double along = step.dot(change_of_gradient);
    if (!(along > 1e-12 * step.norm() * change_of_gradient.norm()))
      return;  // the curvature is not positive, or too small to be reliable
    pairs_.push_back({step, change_of_gradient, 1 / along});
    if (pairs_.size() > kMemory) pairs_.pop_front();
  }
  void forget() { pairs_.clear(); }

  /// - inverse Hessian * gradient, by the two loops of section 2 of the paper. Without a memory, a step of length 1.
  Eigen::VectorXd direction(const Eigen::VectorXd& gradient) const {
    if (pairs_.empty()) return -gradient / std::max(gradient.norm(), 1e-300);
    Eigen::VectorXd q = gradient;
    std::vector<double> alpha(pairs_.size());
    for (std::size_t i = pairs_.size(); i-- > 0;) {
      alpha[i] = pairs_[i].inverse * pairs_[i].step.dot(q);
      q -= alpha[i] * pairs_[i].change;
    }
    q *= 1 / (pairs_.back().inverse * pairs_.back().change.squaredNorm());
    for (std::size_t i = 0; i < pairs_.size(); ++i)
      q += (alpha[i] - pairs_[i].inverse * pairs_[i].change.dot(q)) * pairs_[i].step;
    return -q;
  }

 private:
  struct Pair {
    Eigen::VectorXd step, change;
    double inverse;  ///< 1 / (step . change)
  };
  std::deque<Pair> pairs_;
};

/// Goes along the direction until the value is low enough (Armijo's condition). Step lengths come from parabolas. False
/// if no such point is found.
bool step_along(marrow::optimizer::Evaluations& evaluate, const Eigen::VectorXd& direction, double slope,
                Eigen::VectorXd& here, double& value) {
  double t = 1;
  for (int i = 0; i < 8; ++i) {
    const Eigen::VectorXd there = evaluate.within(here + t * direction);
    if ((there - here).norm() < 0.1 * evaluate.tolerance()) return false;
    const double found = evaluate(there);
    if (found < value + 1e-4 * t * slope) {
      here = there;
      value = found;
      return true;
    }
    t = std::clamp(-slope * t * t / (2 * (found - value - slope * t)), 0.1 * t, 0.5 * t);
  }
  return false;
}

/// 1 for variables that can move along -gradient, 0 for variables that a bound stops.
Eigen::VectorXd free_coordinates(const marrow::optimizer::Evaluations& evaluate, const Eigen::VectorXd& here,
                                 const Eigen::VectorXd& gradient, double h) {
  const Eigen::VectorXd down = here - h * gradient / std::max(gradient.norm(), 1e-300);
  return (evaluate.within(down) - down).unaryExpr([](double cut) { return std::abs(cut) > 1e-12 ? 0.0 : 1.0; });
}

std::string search(marrow::optimizer::Evaluations& evaluate) {
  constexpr double kLongest = 4;
  Eigen::VectorXd here = Eigen::VectorXd::Zero(evaluate.size());
  double value = evaluate(here), h = 0.1;
  Eigen::VectorXd gradient = gradient_at(evaluate, here, h);
  for (Memory memory;;) {
    const Eigen::VectorXd free = free_coordinates(evaluate, here, gradient, h);
    Eigen::VectorXd direction = memory.direction(gradient.cwiseProduct(free)).cwiseProduct(free);
    if (direction.dot(gradient) >= 0) direction = -gradient.cwiseProduct(free);
    if (direction.norm() > kLongest) direction *= kLongest / direction.norm();
    const Eigen::VectorXd before = here;
    if (!step_along(evaluate, direction, direction.dot(gradient), here, value)) {
      if (h <= 0.1 * evaluate.tolerance()) return "steps are below the tolerance";
      // The steps of the differences may be too large to give the slope here.
      h = std::max(0.1 * h, 0.1 * evaluate.tolerance());
      memory.forget();
      gradient = gradient_at(evaluate, here, h);
      continue;
    }
    h = std::clamp(0.1 * (here - before).norm(), 0.1 * evaluate.tolerance(), h);
    const Eigen::VectorXd next = gradient_at(evaluate, here, h);
    memory.add(here - before, next - gradient);
    gradient = next;
  }
}

std::shared_ptr<const marrow::Optimizer> lbfgs() { return marrow::optimizer::optimizer_by(search); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.lbfgs", lbfgs)
      .summary(
          "Quasi-Newton steps from the last eight gradients (L-BFGS: Liu and Nocedal 1989); gradients come from the "
          "cost, or from differences if the cost has none")
      .trait("needs_start")
      .out("optimizer", "minimiser for smooth functions");
}
