// SPDX-License-Identifier: Apache-2.0
// Gradients of patches, and what two pictures have in common.
#include <algorithm>
#include <cmath>

#include "marrow/similarity/intensity.hpp"

namespace marrow::match {

namespace {

/// Sobel's gradients of a row. Its neighbours lie `down` values before and after it.
void sobel(const float* row, std::ptrdiff_t down, int count, float* __restrict du, float* __restrict dv) {
  for (int i = 0; i < count; ++i) {
    const float* p = row + i;
    const float a = p[-down - 1], b = p[-down], d = p[-down + 1], e = p[-1], f = p[1], h = p[down - 1], k = p[down],
                m = p[down + 1];
    du[i] = 0.125f * (d - a + 2 * (f - e) + m - h);
    dv[i] = 0.125f * (h - a + 2 * (k - b) + m - d);
  }
}

/// Which pixels of a row count together with all their neighbours.
void all_around(const char* row, std::ptrdiff_t down, int count, char* __restrict all) {
  for (int i = 0; i < count; ++i) {
    const char* c = row + i;
    all[i] = char(c[-down - 1] & c[-down] & c[-down + 1] & c[-1] & c[0] & c[1] & c[down - 1] & c[down] & c[down + 1]);
  }
}

/// Sobel's gradients of a whole picture.
void gradients_of(const std::vector<float>& values, const Patch& patch, std::vector<float>& u, std::vector<float>& v) {
  u.assign(values.size(), 0.0f);
  v.assign(values.size(), 0.0f);
  for (int row = 1; row + 1 < patch.rows; ++row) {
    const std::size_t i = patch.at(1, row);
    sobel(values.data() + i, patch.columns, patch.columns - 2, u.data() + i, v.data() + i);
  }
}

}  // namespace

Gradients gradients_of(const Patch& patch) {
  Patch u{patch.columns, patch.rows, patch.left, patch.top, {}, {}, {}};
  u.counts.assign(patch.rendered.size(), 0);
  for (int row = 1; row + 1 < patch.rows; ++row) {
    const std::size_t i = patch.at(1, row);
    all_around(patch.counts.data() + i, patch.columns, patch.columns - 2, u.counts.data() + i);
  }
  Gradients g{u, u};
  gradients_of(patch.rendered, patch, g.u.rendered, g.v.rendered);
  gradients_of(patch.seen, patch, g.u.seen, g.v.seen);
  for (std::size_t k = 0; k < 6; ++k)
    if (!patch.slopes[k].empty()) gradients_of(patch.slopes[k], patch, g.u.slopes[k], g.v.slopes[k]);
  return g;
}

Scale scale_of(const Gradients& g) {
  double products = 0, squares = 0;
  const bool has_slopes = !g.u.slopes[0].empty();
  Vector6d by_products = Vector6d::Zero(), by_squares = Vector6d::Zero();
  for (std::size_t i = 0; i < g.u.counts.size(); ++i) {
    if (!g.u.counts[i]) continue;
    const double u = g.u.rendered[i], v = g.v.rendered[i];
    products += u * g.u.seen[i] + v * g.v.seen[i];
    squares += u * u + v * v;
    if (!has_slopes || (u == 0 && v == 0)) continue;
    const Vector6d slopes_u = g.u.slopes_at(i), slopes_v = g.v.slopes_at(i);
    by_products += g.u.seen[i] * slopes_u + g.v.seen[i] * slopes_v;
    by_squares += 2 * (u * slopes_u + v * slopes_v);
  }
  if (!(squares > 0)) return {};
  const double scale = products / squares;
  return {scale, (by_products - scale * by_squares) / squares};
}

namespace {

Moments moments_of(const std::vector<float>& a, const std::vector<float>& b, const std::vector<char>& counts) {
  Moments m;
  // Relative to the first value that counts, so that a large constant causes no rounding errors.
  const auto first = std::find(counts.begin(), counts.end(), 1);
  if (first == counts.end()) return m;
  const std::size_t at = std::size_t(first - counts.begin());
  const double a0 = a[at], b0 = b[at];
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!counts[i]) continue;
    m.add(a[i] - a0, b[i] - b0);
  }
  return m;
}

}  // namespace

double correlation(const std::vector<float>& a, const std::vector<float>& b, const std::vector<char>& counts) {
  const Moments m = moments_of(a, b, counts);
  if (m.n < 16) return 0;
  const double aa = m.spread_a(), bb = m.spread_b(), ab = m.spread_ab();
  if (!(aa > 1e-12 * std::max(m.aa, 1e-30)) || !(bb > 1e-12 * std::max(m.bb, 1e-30))) return 0;
  return std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0);
}

double deviation(const std::vector<float>& values, const std::vector<char>& counts) {
  const Moments m = moments_of(values, values, counts);
  return m.n < 16 ? 0 : std::sqrt(std::max(0.0, m.spread_a()) / m.n);
}

}  // namespace marrow::match
