// SPDX-License-Identifier: Apache-2.0
// Lines by random sample consensus, RANSAC (Fischler and Bolles, CACM 1981). Lines are found one after the other.
// Candidates go through two random edge pixels whose gradients agree with the line. The candidate with the most edge
// pixels is taken, and its pixels are removed before the next search. Then borders are paired as in shaft.hough_pairs.
#include <random>

#include "marrow/shaft/pairs.hpp"

namespace {

using namespace marrow::shaft;
using marrow::EdgeMap, marrow::EdgePixel;

struct Options : LineOptions {
  int samples = 400;
};

// Bins of gradient directions. Both pixels of a sample come from the same bin or from neighbouring bins.
constexpr int kBins = 36;
constexpr double kDirectionCosine = 0.95;  // least cosine between a line's normal and its pixels' gradients

/// The edge pixels that belong to no line yet, in bins by the direction of their gradients.
class Pool {
 public:
  explicit Pool(const EdgeMap& edges) : edges_(edges), bins_(kBins) {
    for (std::size_t i = 0; i < edges.pixels.size(); ++i) bins_[bin(edges.pixels[i])].push_back(i);
  }

  /// A line through two random pixels that are at least `apart_px` apart. Nothing if the two pixels do not fit one
  /// line.
  std::optional<Border> sample(std::mt19937_64& random, std::size_t of, double apart_px) const {
    const EdgePixel& one = nth(of);
    const std::vector<std::size_t>& near = bins_[(bin(one) + random() % 3 + kBins - 1) % kBins];
    if (near.empty()) return std::nullopt;
    const EdgePixel& other = edges_.pixels[near[random() % near.size()]];
    const Eigen::Vector2d a(one.u_px, one.v_px), way = Eigen::Vector2d(other.u_px, other.v_px) - a;
    if (way.norm() < apart_px) return std::nullopt;
    Border line;
    line.normal = Eigen::Vector2d(-way.y(), way.x()).normalized();
    if (line.normal.dot(Eigen::Vector2d(one.direction_u, one.direction_v)) < 0) line.normal = -line.normal;
    line.rho = line.normal.dot(a);
    if (!agrees(line, one) || !agrees(line, other)) return std::nullopt;
    return line;
  }

  /// Calls function(index) for the pixels of the pool that are near a line and whose gradient agrees with it.
  template <class Function>
  void for_near(const Border& line, double tolerance_px, Function function) const {
    const int middle = bin_of(line.normal.x(), line.normal.y());
    for (int step = -2; step <= 2; ++step)  // at least 15 degrees to each side
      for (const std::size_t i : bins_[std::size_t((middle + step + kBins) % kBins)]) {
        const EdgePixel& pixel = edges_.pixels[i];
        const double distance = line.normal.x() * pixel.u_px + line.normal.y() * pixel.v_px - line.rho;
        if (std::abs(distance) < tolerance_px && agrees(line, pixel)) function(i);
      }
  }

  void remove(const std::vector<std::size_t>& pixels) {
    for (const std::size_t i : pixels) std::erase(bins_[bin(edges_.pixels[i])], i);
  }

  std::size_t size() const {
    std::size_t sum = 0;
    for (const auto& bin : bins_) sum += bin.size();
    return sum;
  }

 private:
  static int bin_of(double u, double v) {
    return int(std::floor((std::atan2(v, u) + marrow::kPi) / (2 * marrow::kPi) * kBins)) % kBins;
  }
  static std::size_t bin(const EdgePixel& pixel) { return std::size_t(bin_of(pixel.direction_u, pixel.direction_v)); }
  static bool agrees(const Border& line, const EdgePixel& pixel) {
    return line.normal.x() * pixel.direction_u + line.normal.y() * pixel.direction_v > kDirectionCosine;
  }
  const EdgePixel& nth(std::size_t index) const {
    std::size_t bin = 0;
    while (index >= bins_[bin].size()) index -= bins_[bin++].size();
    return edges_.pixels[bins_[bin][index]];
  }

  const EdgeMap& edges_;
  std::vector<std::vector<std::size_t>> bins_;
};

/// Lines with many pixels, in the order in which they are found.
std::vector<Border> ransac_lines(const EdgeMap& edges, const Scale& scale, const Options& options,
                                 marrow::Context& context) {
  std::mt19937_64 random(context.seed());
  Pool pool(edges);
  const double tolerance_px = 0.5 * scale.support.tolerance_px;
  std::vector<Border> lines;
  for (int round = 0; round < options.lines; ++round) {
    context.check_cancelled();
    const std::size_t left = pool.size();
    Border best;
    for (int i = 0; i < options.samples && left > 0; ++i) {
      const auto line = pool.sample(random, std::size_t(random() % left), 0.3 * scale.min_length_px);
      if (!line) continue;
      int count = 0;
      pool.for_near(*line, tolerance_px, [&](std::size_t) { ++count; });
      if (count > best.pixels) best = *line, best.pixels = count;
    }
    if (best.pixels < std::max(10, int(0.3 * scale.min_length_px))) break;
    std::vector<std::size_t> own;
    pool.for_near(best, tolerance_px, [&](std::size_t i) { own.push_back(i); });
    pool.remove(own);
    lines.push_back(best);
  }
  return lines;
}

marrow::ShaftLines ransac(const EdgeMap& edges, const marrow::View& view, const marrow::List<marrow::View>* views,
                          const Options& options, marrow::Context& context) {
  const Scale scale = checked_scale(edges, view, views, options, context);
  return best_pair(edges, view, supported_lines(edges, ransac_lines(edges, scale, options, context), scale, options),
                   scale, options);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_line_options(plugin.node("shaft.ransac", ransac)
                           .summary("Borders of the shaft: lines by random sample consensus (RANSAC), paired by the "
                                    "likelihood of the outer diameter")
                           .random()
                           .option("samples", &Options::samples, "number of candidates for each line",
                                   marrow::at_least(1), marrow::at_most(100000)));
}
