// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>
#include <numeric>
#include <random>
#include <vector>

#include <marrow/domain/decompositions.hpp>
#include "marrow/optimizer/evaluations.hpp"

namespace {

struct Options {
  int population = 0;
  double first_spread = 0.5;
  int seed = 1;
};

/// Normally distributed random numbers. They are the same with every standard library.
class Normal {
 public:
  explicit Normal(unsigned seed) : random_(seed) {}
  double operator()() {
    const auto uniform = [&] { return (double(random_()) + 0.5) / 4294967296.0; };
    return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * marrow::kPi * uniform());
  }

 private:
  std::mt19937 random_;
};

/// The state of the evolution strategy, with the constants of Hansen's tutorial (arXiv 1604.00772, table 1).
class Strategy {
 public:
  Strategy(Eigen::Index n, const Options& options)
      : n_(n),
        lambda_(options.population > 0 ? options.population : 4 + int(3 * std::log(double(n)))),
        sigma_(options.first_spread),
        normal_(unsigned(options.seed)),
        mean_(Eigen::VectorXd::Zero(n)),
        path_c_(mean_),
        path_s_(mean_),
        covariance_(Eigen::MatrixXd::Identity(n, n)),
        axes_(covariance_),
        lengths_(Eigen::VectorXd::Ones(n)) {
    weights_.resize(lambda_ / 2);
    for (int i = 0; i < weights_.size(); ++i) weights_[i] = std::log(0.5 * (lambda_ + 1)) - std::log(i + 1.0);
    weights_ /= weights_.sum();
    mu_ = 1 / weights_.squaredNorm();
    const double d = double(n);
    c_s_ = (mu_ + 2) / (d + mu_ + 5);
    damping_ = 1 + 2 * std::max(0.0, std::sqrt((mu_ - 1) / (d + 1)) - 1) + c_s_;
    c_c_ = (4 + mu_ / d) / (d + 4 + 2 * mu_ / d);
    c_1_ = 2 / ((d + 1.3) * (d + 1.3) + mu_);
    c_mu_ = std::min(1 - c_1_, 2 * (mu_ - 2 + 1 / mu_) / ((d + 2) * (d + 2) + mu_));
    expected_ = std::sqrt(d) * (1 - 1 / (4 * d) + 1 / (21 * d * d));
  }

  /// Computes one generation. True if its spread is below the tolerance.
  bool step(marrow::optimizer::Evaluations& evaluate) {
    std::vector<Eigen::VectorXd> points;
    std::vector<double> values;
    for (int i = 0; i < lambda_; ++i) {
      Eigen::VectorXd z(n_);
      for (Eigen::Index k = 0; k < n_; ++k) z[k] = normal_();
      points.push_back(evaluate.within(mean_ + sigma_ * (axes_ * lengths_.cwiseProduct(z))));
      values.push_back(evaluate(points.back()));
    }
    std::vector<int> order(points.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return values[std::size_t(a)] < values[std::size_t(b)]; });
    adapt(points, order);
    return sigma_ * lengths_.maxCoeff() < evaluate.tolerance();
  }

 private:
  void adapt(const std::vector<Eigen::VectorXd>& points, const std::vector<int>& order) {
    const Eigen::VectorXd before = mean_;
    mean_.setZero();
    for (int i = 0; i < weights_.size(); ++i) mean_ += weights_[i] * points[std::size_t(order[std::size_t(i)])];
    const Eigen::VectorXd shift = (mean_ - before) / sigma_;
    const Eigen::VectorXd white = axes_ * (axes_.transpose() * shift).cwiseQuotient(lengths_);
    path_s_ = (1 - c_s_) * path_s_ + std::sqrt(c_s_ * (2 - c_s_) * mu_) * white;
    ++generation_;
    const double length = path_s_.norm() / std::sqrt(1 - std::pow(1 - c_s_, 2 * generation_));
    const bool is_slow = length < (1.4 + 2 / (double(n_) + 1)) * expected_;
    path_c_ = (1 - c_c_) * path_c_ + (is_slow ? std::sqrt(c_c_ * (2 - c_c_) * mu_) : 0) * shift;
    Eigen::MatrixXd rank_mu = Eigen::MatrixXd::Zero(n_, n_);
    for (int i = 0; i < weights_.size(); ++i) {
      const Eigen::VectorXd y = (points[std::size_t(order[std::size_t(i)])] - before) / sigma_;
      rank_mu += weights_[i] * y * y.transpose();
    }
    covariance_ = (1 - c_1_ - c_mu_) * covariance_ +
                  c_1_ * (path_c_ * path_c_.transpose() + (is_slow ? 0 : c_c_ * (2 - c_c_)) * covariance_) +
                  c_mu_ * rank_mu;
    sigma_ *= std::exp(std::min(1.0, c_s_ / damping_ * (path_s_.norm() / expected_ - 1)));
    const marrow::SymmetricEigen<Eigen::Dynamic> eigen = marrow::eigen_of_symmetric(covariance_);
    axes_ = eigen.vectors;
    lengths_ = eigen.values.cwiseMax(1e-20).cwiseSqrt();
  }

  const Eigen::Index n_;
  const int lambda_;
  double sigma_, mu_ = 0, c_s_ = 0, damping_ = 0, c_c_ = 0, c_1_ = 0, c_mu_ = 0, expected_ = 0;
  int generation_ = 0;
  Normal normal_;
  Eigen::VectorXd weights_, mean_, path_c_, path_s_;
  Eigen::MatrixXd covariance_, axes_;
  Eigen::VectorXd lengths_;
};

std::shared_ptr<const marrow::Optimizer> cma_es(const Options& options) {
  if (options.population != 0 && options.population < 4)
    throw marrow::Error(
        marrow::formatted("population: expected 4 or more, or 0 for the usual number, got {}", options.population));
  return marrow::optimizer::optimizer_by([options](marrow::optimizer::Evaluations& evaluate) -> std::string {
    evaluate(Eigen::VectorXd::Zero(evaluate.size()));
    Strategy strategy(evaluate.size(), options);
    while (!strategy.step(evaluate)) {
    }
    return "steps are below the tolerance";
  });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.cma_es", cma_es)
      .summary(
          "Covariance matrix adaptation evolution strategy, CMA-ES (Hansen and Ostermeier, Evolutionary Computation "
          "2001; Hansen 2016)")
      .trait("needs_start")
      .out("optimizer", "minimiser without derivatives, for rugged functions")
      .option("population", &Options::population, "number of points in a generation; 0: 4 + 3 ln n for n variables",
              marrow::at_least(0), marrow::at_most(10000))
      .option("first_spread", &Options::first_spread,
              "standard deviation of the first generation, in units of the initial steps", marrow::at_least(1e-6),
              marrow::unit("1"))
      .option("seed", &Options::seed, "seed of the random numbers", marrow::at_least(0));
}
