// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/sequential.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

/// A standard Brownian motion that is watched at some times, as long as it stays between bounds. At the time t it
/// stands for the test's sum, whose variance is t. So z is its place divided by sqrt(t).
class WatchedMotion {
 public:
  /// The bound z >= 0 that the motion exceeds on either side at `time`, for the first time, with the probability
  /// `chance`. From then on, only motions within this bound are watched.
  double bound_at(double time, double chance) {
    const double sd = std::sqrt(time - time_);
    double below = 0, above = kFarthest;
    while (above - below > 1e-10) {
      const double middle = 0.5 * (below + above);
      (chance_beyond(middle * std::sqrt(time), sd) > chance ? below : above) = middle;
    }
    const double bound = 0.5 * (below + above);
    move_to(time, std::min(bound, kFarthestPlace) * std::sqrt(time), sd);
    return bound;
  }

 private:
  static constexpr double kFarthest = 40;      // its tail is below the smallest double
  static constexpr double kFarthestPlace = 8;  // the sums end here; the probability beyond is 1e-15
  static constexpr std::size_t kPlaces = 301;  // odd, for Simpson's rule

  double chance_beyond(double place, double sd) const {
    if (places_.empty()) return 2 * upper_tail(place / sd);
    double chance = 0;
    for (std::size_t i = 0; i < kPlaces; ++i)
      chance += masses_[i] * (upper_tail((place - places_[i]) / sd) + upper_tail((place + places_[i]) / sd));
    return chance;
  }

  /// Simpson's rule: `masses` are densities times weights.
  void move_to(double time, double end, double sd) {
    std::vector<double> places(kPlaces), masses(kPlaces);
    const double step = 2 * end / double(kPlaces - 1);
    for (std::size_t i = 0; i < kPlaces; ++i) {
      places[i] = -end + step * double(i);
      const double weight = i == 0 || i == kPlaces - 1 ? 1 : i % 2 ? 4 : 2;
      masses[i] = weight * step / 3 * density(places[i], sd);
    }
    places_ = std::move(places);
    masses_ = std::move(masses);
    time_ = time;
  }

  double density(double place, double sd) const {
    const auto normal = [&](double x) {
      return std::exp(-0.5 * x * x / (sd * sd)) / (sd * std::sqrt(2 * std::numbers::pi));
    };
    if (places_.empty()) return normal(place);
    double sum = 0;
    for (std::size_t i = 0; i < kPlaces; ++i) sum += masses_[i] * normal(place - places_[i]);
    return sum;
  }

  double time_ = 0;
  std::vector<double> places_, masses_;  ///< of the motion at time_, where it is still watched
};

double spent(double share, double alpha, Spending spending) {
  if (share <= 0) return 0;
  if (spending == Spending::even) return alpha * std::log(1 + (std::numbers::e - 1) * share);
  return 4 * upper_tail(z_of_tail(alpha / 4) / std::sqrt(share));
}

}  // namespace

std::vector<double> levels_of_looks(const std::vector<double>& information, double alpha, Spending spending) {
  if (!(alpha >= 0.001 && alpha <= 0.5))
    throw Error(formatted("alpha is {:f}; give a fraction from 0.001 to 0.5, such as 0.05", alpha));
  if (information.empty()) throw Error("there are no looks; give at least one");
  WatchedMotion motion;
  std::vector<double> levels;
  double before = 0;
  for (const double share : information) {
    if (!(share > before && share <= 1))
      throw Error(formatted(
          "look {} has seen the share {:f} of the cases; expected more than at the look before, and at most 1",
          levels.size() + 1, share));
    const double chance = spent(share, alpha, spending) - spent(before, alpha, spending);
    levels.push_back(2 * upper_tail(motion.bound_at(share, chance)));
    before = share;
  }
  return levels;
}

std::vector<std::size_t> looks_at(std::size_t first, std::size_t every, std::size_t most) {
  if (!first || !every || most < first)
    throw Error(
        formatted("looks begin at {} cases and end at {}, one every {}; expected at least 1 for each, and an end not "
                  "before the beginning",
                  first, most, every));
  std::vector<std::size_t> looks;
  for (std::size_t cases = first; cases < most; cases += every) looks.push_back(cases);
  looks.push_back(most);
  return looks;
}

}  // namespace marrow::compare
