// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>
#include <vector>

#include "marrow/optimizer/evaluations.hpp"

namespace {

/// Minimises the value along a line. The steps grow until the value rises again. Then the minimum between the last
/// three points is refined by parabolas.
class Line {
 public:
  Line(marrow::optimizer::Evaluations& evaluate, const Eigen::VectorXd& from, double value,
       const Eigen::VectorXd& direction)
      : evaluate_(evaluate), from_(from), direction_(direction), value_(value) {}

  /// Finds the least value along the line. Returns its signed distance from the start, in lengths of the direction.
  double minimise(double step) {
    double a = 0, fa = value_, b = step, fb = at(b);
    if (fb > fa) std::swap(a, b), std::swap(fa, fb);
    double c = b + 1.618 * (b - a), fc = at(c);
    for (int i = 0; fc < fb && i < 30; ++i) {
      a = b, fa = fb, b = c, fb = fc;
      c = b + 1.618 * (b - a), fc = at(c);
    }
    const double fine = std::max(0.1 * evaluate_.tolerance(), 1e-3 * std::abs(step));
    for (int i = 0; i < 12 && std::abs(c - a) > 2 * fine; ++i) {
      const double p = (b - a) * (fb - fc), q = (b - c) * (fb - fa);
      double x = std::abs(p - q) > 1e-300 ? b - 0.5 * ((b - a) * p - (b - c) * q) / (p - q) : b;
      const double low = std::min(a, c), high = std::max(a, c);
      if (!(x > low && x < high) || std::abs(x - b) < fine)
        x = std::abs(c - b) > std::abs(b - a) ? b + 0.382 * (c - b) : b - 0.382 * (b - a);
      const double fx = at(x);
      if (fx < fb) {
        (x - b) * (c - b) > 0 ? (a = b, fa = fb) : (c = b, fc = fb);
        b = x, fb = fx;
      } else {
        (x - b) * (c - b) > 0 ? (c = x, fc = fx) : (a = x, fa = fx);
      }
    }
    value_ = fb;
    return b;
  }
  double value() const { return value_; }

 private:
  double at(double t) { return evaluate_(from_ + t * direction_); }

  marrow::optimizer::Evaluations& evaluate_;
  const Eigen::VectorXd from_, direction_;
  double value_;
};

/// Powell's method with the rule of section 3 of his paper: the direction of the greatest decrease is replaced by the
/// direction of the whole round, unless the directions would become linearly dependent.
std::string search(marrow::optimizer::Evaluations& evaluate) {
  const Eigen::Index n = evaluate.size();
  Eigen::MatrixXd directions = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd here = Eigen::VectorXd::Zero(n);
  double value = evaluate(here);
  for (double step = 1;;) {
    const Eigen::VectorXd start = here;
    const double before = value;
    Eigen::Index greatest = 0;
    double fall = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      Line line(evaluate, here, value, directions.col(i));
      const double moved = line.minimise(step);
      if (value - line.value() > fall) fall = value - line.value(), greatest = i;
      if (line.value() < value) here = evaluate.within(here + moved * directions.col(i)), value = line.value();
    }
    const Eigen::VectorXd round = here - start;
    if (round.norm() < evaluate.tolerance()) {
      if (step <= 10 * evaluate.tolerance()) return "steps are below the tolerance";
      step *= 0.2;
      continue;
    }
    const double beyond = evaluate(here + round);
    if (beyond < before &&
        2 * (before - 2 * value + beyond) * std::pow(before - value - fall, 2) < fall * std::pow(before - beyond, 2)) {
      Line line(evaluate, here, value, round.normalized());
      const double moved = line.minimise(std::max(round.norm(), evaluate.tolerance()));
      if (line.value() < value) here = evaluate.within(here + moved * round.normalized()), value = line.value();
      directions.col(greatest) = directions.col(n - 1);
      directions.col(n - 1) = round.normalized();
    }
    step = std::clamp(round.norm(), evaluate.tolerance(), 1.0);
  }
}

std::shared_ptr<const marrow::Optimizer> powell() { return marrow::optimizer::optimizer_by(search); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.powell", powell)
      .summary("Line searches along directions that become conjugate (Powell's method, Computer Journal 1964)")
      .trait("needs_start")
      .out("optimizer", "minimiser without derivatives");
}
