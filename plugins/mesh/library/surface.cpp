// SPDX-License-Identifier: Apache-2.0
#include "marrow/mesh/surface.hpp"

#include <tbb/parallel_for.h>

#include <tbb/blocked_range.h>
#include <atomic>
#include <cstring>
#include <numeric>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow::surface {
namespace {

/// The signs of a run of samples. Computed without branches, so that the compiler can vectorise the loop.
struct Packed {
  Word inside = 0;
  bool finite = true;
};

Packed pack(const float* values, int count) {
  std::uint8_t flags[64] = {};
  std::uint32_t not_finite = 0;
  for (int i = 0; i < count; ++i) {
    flags[i] = values[i] < 0;
    not_finite |= std::uint32_t(!(values[i] - values[i] == 0));
  }
  Packed packed;
  packed.finite = not_finite == 0;
  for (int group = 0; group < 8; ++group) {  // one multiplication collects the lowest bits of eight bytes
    Word eight;
    std::memcpy(&eight, flags + 8 * group, 8);
    packed.inside |= (eight * 0x0102040810204080u >> 56) << (8 * group);
  }
  return packed;
}

}  // namespace

Signs::Signs(const marrow::SignedField& field)
    : padded_(field),
      size_{field.grid.size[0] + 2, field.grid.size[1] + 2, field.grid.size[2] + 2},
      words_((size_[0] + 63) / 64) {
  check_grid(field);
  bits_.resize(std::size_t(words_) * size_[1] * size_[2], 0);
  std::atomic<bool> all_finite = true, any_inside = false, any_outside = false;
  tbb::parallel_for(1, size_[2] - 1, [&](int z) {
    bool finite = true, inside = false, outside = false;
    for (int y = 1; y < size_[1] - 1; ++y) {
      const float* row = field.values_mm.data() + field.grid.offset(0, y - 1, z - 1);
      Word* packed = bits_.data() + (std::size_t(z) * size_[1] + y) * words_;
      for (int word = 0; word < words_; ++word) {  // bit 0 of a row is padding, so words are shifted by one sample
        const int first = std::max(64 * word, 1), last = std::min(64 * word + 64, size_[0] - 1);
        if (first >= last) continue;
        const Packed run = pack(row + first - 1, last - first);
        packed[word] = run.inside << (first - 64 * word);
        finite &= run.finite;
        inside |= run.inside != 0;
        outside |= std::popcount(run.inside) < last - first;
      }
    }
    if (!finite) all_finite = false;
    if (inside) any_inside = true;
    if (outside) any_outside = true;
  });
  check_values(all_finite, any_inside, any_outside);
}

using marrow::Error, marrow::Mesh;

void check_grid(const marrow::SignedField& field) {
  const auto& size = field.grid.size;
  if (size[0] <= 0 || size[1] <= 0 || size[2] <= 0 || field.values_mm.size() != field.grid.count())
    throw Error(
        formatted("field: {} values do not fill a grid of {} x {} x {} voxels; wire the output of a segment node",
                  field.values_mm.size(), size[0], size[1], size[2]));
  marrow::check_rigid({field.grid.frame, "grid", field.grid.direction, field.grid.origin_mm}, "field");
}

void check_values(bool all_finite, bool any_inside, bool any_outside) {
  if (!all_finite) throw Error("field: some values are not finite numbers; a signed distance in mm was expected");
  if (!any_inside)
    throw Error(
        "field: there is no surface, as no value is negative (inside); the segmentation found nothing: check its "
        "seeds and thresholds");
  if (!any_outside)
    throw Error(
        "field: there is no surface, as every value is negative (inside); the segmentation ran over the whole "
        "volume: raise its threshold");
}

void check_vertex_count(std::size_t count) {
  if (count > 0x7fffffff)
    throw Error(formatted(
        "field: its surface has {} vertices, more than a mesh can index; the field is noise or the grid far too fine",
        count));
}

void check_field(const marrow::SignedField& field) {
  check_grid(field);
  bool finite = true, inside = false, outside = false;
  for (float value : field.values_mm) {
    finite &= std::isfinite(value);
    inside |= value < 0;
    outside |= value >= 0;
  }
  check_values(finite, inside, outside);
}

namespace {

/// Connected components (union-find). Each vertex points to an earlier vertex of its component, the first vertex to
/// itself. Several threads may join at once: only a first vertex gets a new target, by compare-exchange.
class Parts {
 public:
  explicit Parts(const Mesh& mesh) : before_(mesh.vertices_mm.size()) {
    std::iota(before_.begin(), before_.end(), 0u);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        join(mesh.triangles[i][0], mesh.triangles[i][1]);
        join(mesh.triangles[i][0], mesh.triangles[i][2]);
      }
    });
  }

  /// The component of each vertex, numbered from 0 in the order of their first vertices.
  std::vector<std::uint32_t> numbers(std::uint32_t& count) && {
    count = 0;
    for (std::uint32_t v = 0; v < before_.size(); ++v) before_[v] = before_[v] == v ? count++ : before_[before_[v]];
    return std::move(before_);
  }

 private:
  std::atomic_ref<std::uint32_t> before(std::uint32_t v) { return std::atomic_ref(before_[v]); }

  std::uint32_t first_of(std::uint32_t v) {
    for (;;) {
      const std::uint32_t parent = before(v).load(std::memory_order_relaxed);
      if (parent == v) return v;
      const std::uint32_t next = before(parent).load(std::memory_order_relaxed);
      if (next != parent) before(v).store(next, std::memory_order_relaxed);
      v = next;
    }
  }
  void join(std::uint32_t a, std::uint32_t b) {
    for (;;) {
      a = first_of(a), b = first_of(b);
      if (a == b) return;
      std::uint32_t last = std::max(a, b);
      if (before(last).compare_exchange_strong(last, std::min(a, b), std::memory_order_relaxed)) return;
    }
  }

  std::vector<std::uint32_t> before_;
};

/// Six times the volume that each component encloses. The order of summation does not depend on the threads.
std::vector<double> six_volumes(const Mesh& mesh, const std::vector<std::uint32_t>& part, std::uint32_t count) {
  constexpr std::size_t kChunks = 8;
  const Eigen::Vector3d origin = mesh.vertices_mm[mesh.triangles.front()[0]];
  std::vector<std::vector<double>> sums(kChunks, std::vector<double>(count, 0));
  tbb::parallel_for(std::size_t(0), kChunks, [&](std::size_t chunk) {
    for (std::size_t i = mesh.triangles.size() * chunk / kChunks; i < mesh.triangles.size() * (chunk + 1) / kChunks;
         ++i) {
      const auto& t = mesh.triangles[i];
      const Eigen::Vector3d a = mesh.vertices_mm[t[0]] - origin, b = mesh.vertices_mm[t[1]] - origin,
                            c = mesh.vertices_mm[t[2]] - origin;
      sums[chunk][part[t[0]]] += a.dot(b.cross(c));
    }
  });
  for (std::size_t chunk = 1; chunk < kChunks; ++chunk)
    for (std::uint32_t k = 0; k < count; ++k) sums[0][k] += sums[chunk][k];
  return sums[0];
}

}  // namespace

Mesh largest_component(Mesh mesh) {
  if (mesh.triangles.empty()) return mesh;
  std::uint32_t count = 0;
  std::vector<std::uint32_t> part = Parts(mesh).numbers(count);
  if (count == 1) return mesh;
  const std::vector<double> volumes = six_volumes(mesh, part, count);
  const auto best = std::uint32_t(std::max_element(volumes.begin(), volumes.end()) - volumes.begin());

  constexpr std::uint32_t kDropped = 0xffffffff;
  std::uint32_t vertices = 0;  // from here on, part[v] is the vertex's new index
  for (std::uint32_t v = 0; v < part.size(); ++v) {
    if (part[v] == best) mesh.vertices_mm[vertices] = mesh.vertices_mm[v];
    part[v] = part[v] == best ? vertices++ : kDropped;
  }
  mesh.vertices_mm.resize(vertices);
  std::size_t triangles = 0;
  for (const auto& t : mesh.triangles)
    if (part[t[0]] != kDropped) mesh.triangles[triangles++] = {part[t[0]], part[t[1]], part[t[2]]};
  mesh.triangles.resize(triangles);
  return mesh;
}

void check_stable(const Taubin& taubin, const std::string& what) {
  const double band = taubin.pass_band, lambda = taubin.lambda;
  // A pair of steps multiplies a wave of the frequency k by 1 + lambda |mu| k (pass_band - k), with k up to 2. The
  // factor of k = 2 is at least -1 as long as (2 - pass_band) lambda^2 + pass_band lambda <= 1.
  const double most_lambda = (std::sqrt(band * band + 4 * (2 - band)) - band) / (2 * (2 - band));
  if (!(lambda <= most_lambda))
    throw Error(
        formatted("{}: with lambda {:g} and pass_band {:g} the shortest waves grow with each step, and tear the "
                  "surface apart; give a lambda of at most {:.3f}",
                  what, lambda, band, std::floor(1000 * most_lambda) / 1000));
  // The factor is largest at k = pass_band / 2.
  constexpr double kMostGrowth = 1.15;
  const double growth = 1 + lambda * lambda / (1 - lambda * band) * band * band / 4;
  const double most_iterations = std::floor(std::log(kMostGrowth) / std::log(growth));
  if (taubin.iterations > most_iterations)
    throw Error(
        formatted("{}: {} iterations inflate waves of the surface by more than 15 %; give at most {:.0f}, or a smaller "
                  "pass_band or lambda",
                  what, taubin.iterations, most_iterations));
}

void smooth(Mesh& mesh, const Taubin& taubin) {
  const double mu = 1 / (taubin.pass_band - 1 / taubin.lambda);
  // On a closed surface each edge occurs once in each direction, so each neighbour is counted exactly once here.
  std::vector<std::uint32_t> degree(mesh.vertices_mm.size(), 0);
  for (const auto& t : mesh.triangles)
    for (std::uint32_t v : t) ++degree[v];
  std::vector<Eigen::Vector3d> sum(mesh.vertices_mm.size());
  for (int step = 0; step < 2 * taubin.iterations; ++step) {
    std::fill(sum.begin(), sum.end(), Eigen::Vector3d::Zero());
    for (const auto& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) sum[t[k]] += mesh.vertices_mm[t[(k + 1) % 3]];
    const double weight = step % 2 ? mu : taubin.lambda;
    for (std::size_t v = 0; v < sum.size(); ++v)
      if (degree[v]) mesh.vertices_mm[v] += weight * (sum[v] / degree[v] - mesh.vertices_mm[v]);
  }
}

Mesh finish(Mesh mesh, const Finish& options) {
  if (options.largest_only) mesh = largest_component(std::move(mesh));
  smooth(mesh, {.iterations = options.smoothing});
  return mesh;
}

}  // namespace marrow::surface
