// SPDX-License-Identifier: Apache-2.0
#include "intensity.hpp"

#include "expansions.hpp"

namespace marrow::match {
namespace {

using ViewExpansion = ViewsCost::ViewExpansion;

constexpr double kWorstCorrelation = 2;

/// The quadratic model of SumMeasure::value().
Cost::Expansion expansion_of(const SumMeasure& measure, const SumsExpansion& all) {
  const auto& [values, weights] = all.sums;
  Cost::Expansion expansion;
  expansion.value = measure.value(all.sums);
  const double divisor = measure.whole ? *measure.whole : weights;
  if (!(divisor > 0) || (measure.whole && expansion.value >= kWorstCorrelation)) return expansion;
  expansion.gradient = -all.by_values / divisor;
  if (!measure.whole) expansion.gradient += values / (divisor * divisor) * all.by_weights;
  expansion.curvature = all.curvature / divisor;
  return expansion;
}

/// Of 1 - the mean correlation.
Cost::Expansion expansion_of(const std::vector<JointMoments>& compared) {
  Cost::Expansion expansion;
  expansion.value = 1;
  for (const JointMoments& moments : compared) {
    const CorrelationExpansion one = correlation_expansion(moments);
    const double share = 1.0 / double(compared.size());
    expansion.value -= share * one.value;
    expansion.gradient -= share * one.by_value;
    expansion.curvature += share * one.curvature;
  }
  return expansion;
}

ViewExpansion by_sums(const SumMeasure& measure, const Patch& patch, double step_px, const Blocks& blocks) {
  ExpansionTally tally(blocks);
  TallyOfExpansions places(patch, step_px, tally);
  measure.add_expansion(patch, places);
  ViewExpansion view{expansion_of(measure, tally.all()), {}};
  for (const SumsExpansion& block : tally.of_block()) {
    SumsExpansion left = tally.all();
    left -= block;
    view.without_block.push_back(expansion_of(measure, left));
  }
  return view;
}

ViewExpansion by_correlations(const CorrelationMeasure& measure, const Patch& patch, double step_px,
                              const Blocks& blocks) {
  const std::vector<Patch> compared = measure.compared(patch);
  std::vector<JointMoments> all(compared.size());
  std::vector<std::vector<JointMoments>> of_block(std::size_t(blocks.count()), all);
  for (std::size_t k = 0; k < compared.size(); ++k) {
    const Patch& one = compared[k];
    for (int row = 0; row < patch.rows; ++row)
      for (int column = 0; column < patch.columns; ++column) {
        const std::size_t i = patch.at(column, row);
        if (!one.counts[i]) continue;
        of_block[std::size_t(blocks.at((patch.left + column) * step_px, (patch.top + row) * step_px))][k].add_pixel(
            one.slopes_at(i), one.rendered[i], one.seen[i]);
      }
    for (const auto& block : of_block) all[k] += block[k];
  }
  ViewExpansion view{expansion_of(all), {}};
  for (const auto& block : of_block) {
    std::vector<JointMoments> left = all;
    for (std::size_t k = 0; k < left.size(); ++k) left[k] -= block[k];
    view.without_block.push_back(expansion_of(left));
  }
  return view;
}

void make_finite(Cost::Expansion& expansion, double worst) {
  if (std::isfinite(expansion.value) && expansion.gradient.allFinite() && expansion.curvature.allFinite()) return;
  expansion = {};
  expansion.value = worst;
}

}  // namespace

double SumMeasure::value(const BlockSums::Sums& sums) const {
  if (whole) return *whole > 0 ? std::min(kWorstCorrelation, 1 - sums.values / *whole) : 1;
  return sums.weights > 0 ? 1 - sums.values / sums.weights : kWorstCorrelation;
}

double value_of(const Measure& measure, const Patch& patch, double step_px, const Blocks& blocks) {
  if (const auto* whole = std::get_if<WholeMeasure>(&measure)) return whole->value(patch);
  if (const auto* correlations = std::get_if<CorrelationMeasure>(&measure)) {
    const std::vector<Patch> compared = correlations->compared(patch);
    double sum = 0;
    for (const Patch& one : compared) sum += correlation(one.rendered, one.seen, one.counts);
    return 1 - sum / double(compared.size());
  }
  const auto& sum = std::get<SumMeasure>(measure);
  BlockSums sums(blocks);
  Tally tally(patch, step_px, sums);
  sum.add(patch, tally);
  return sum.value(sums.all());
}

bool has_derivatives(const Measure& measure) {
  if (const auto* sum = std::get_if<SumMeasure>(&measure)) return bool(sum->add_expansion);
  const auto* whole = std::get_if<WholeMeasure>(&measure);
  return !whole || bool(whole->expansion);
}

ViewExpansion expansion_of(const Measure& measure, const Patch& patch, double step_px, const Blocks& blocks,
                           double worst) {
  ViewExpansion view;
  if (patch.rendered.empty()) {
    view.whole.value = worst;
    view.without_block.assign(std::size_t(blocks.count()), view.whole);
    return view;
  }
  if (const auto* sum = std::get_if<SumMeasure>(&measure))
    view = by_sums(*sum, patch, step_px, blocks);
  else if (const auto* correlations = std::get_if<CorrelationMeasure>(&measure))
    view = by_correlations(*correlations, patch, step_px, blocks);
  else
    view.whole = std::get<WholeMeasure>(measure).expansion(patch);
  make_finite(view.whole, worst);
  for (Cost::Expansion& without : view.without_block) make_finite(without, worst);
  return view;
}

void add(const Cost::Expansion& more, double share, Cost::Expansion& sum) {
  sum.value += share * more.value;
  sum.gradient += share * more.gradient;
  sum.curvature += share * more.curvature;
}

SumsExpansion& SumsExpansion::operator+=(const SumsExpansion& more) {
  sums.values += more.sums.values;
  sums.weights += more.sums.weights;
  by_values += more.by_values;
  by_weights += more.by_weights;
  curvature += more.curvature;
  return *this;
}

SumsExpansion& SumsExpansion::operator-=(const SumsExpansion& less) {
  sums.values -= less.sums.values;
  sums.weights -= less.sums.weights;
  by_values -= less.by_values;
  by_weights -= less.by_weights;
  curvature -= less.curvature;
  return *this;
}

JointMoments& JointMoments::operator+=(const JointMoments& more) {
  n += more.n;
  if (!more.shows_bone) {
    sums[kSeen] += more.sums[kSeen];
    products(kSeen, kSeen) += more.products(kSeen, kSeen);
    return *this;
  }
  shows_bone = true;
  sums += more.sums;
  products += more.products;
  return *this;
}

JointMoments& JointMoments::operator-=(const JointMoments& less) {
  n -= less.n;
  sums -= less.sums;
  products -= less.products;
  return *this;
}

CorrelationExpansion correlation_expansion(const JointMoments& moments) {
  constexpr double kLeastPixels = 16;
  constexpr int a = JointMoments::kRendered, b = JointMoments::kSeen;
  CorrelationExpansion expansion;
  if (moments.n < kLeastPixels) return expansion;
  const JointMoments::Matrix spread = moments.spread();
  const double aa = spread(a, a), bb = spread(b, b);
  if (!(aa > 1e-9 + 1e-12 * moments.products(a, a))) return expansion;
  const Vector6d with_a = spread.col(a).head<6>();
  expansion.spread = aa;
  expansion.by_spread = 2 * with_a;
  if (!(bb > 1e-14 + 1e-12 * moments.products(b, b))) return expansion;
  const double per_deviations = 1 / std::sqrt(aa * bb);
  expansion.value = std::clamp(spread(a, b) * per_deviations, -1.0, 1.0);
  expansion.by_value = per_deviations * spread.col(b).head<6>() - expansion.value / aa * with_a;
  // The normalised radiograph is a unit vector; what changes its direction lowers the correlation.
  expansion.curvature =
      std::max(expansion.value, 0.0) / aa * (spread.topLeftCorner<6, 6>() - with_a * with_a.transpose() / aa);
  return expansion;
}

}  // namespace marrow::match
