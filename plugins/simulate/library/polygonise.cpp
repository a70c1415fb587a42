// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/polygonise.hpp"

#include <tbb/parallel_for.h>

#include <unordered_map>

namespace marrow::phantom {
namespace {

constexpr int kBlock = 8;
// The six tetrahedra around the diagonal from corner 0 to corner 7 of a cube (corner bits: x 1, y 2, z 4). All have
// positive volume. Neighbouring cubes cut their common face along the same diagonal.
constexpr int kTetrahedra[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};

struct Lattice {
  Eigen::Vector3d low;
  double spacing;
  std::array<int, 3> size;
  std::vector<float> values;

  std::size_t index(int x, int y, int z) const { return (std::size_t(z) * size[1] + y) * size[0] + x; }
  Eigen::Vector3d point(std::size_t i) const {
    const std::size_t nx = std::size_t(size[0]), ny = std::size_t(size[1]);
    const std::size_t x = i % nx, y = i / nx % ny, z = i / (nx * ny);
    return low + spacing * Eigen::Vector3d(double(x), double(y), double(z));
  }
};

void fill_block(Lattice& lattice, const std::function<double(const Eigen::Vector3d&)>& field, double steepest,
                const std::array<int, 3>& from) {
  const Eigen::Vector3d middle = lattice.point(lattice.index(from[0], from[1], from[2])) +
                                 Eigen::Vector3d::Constant(0.5 * (kBlock - 1) * lattice.spacing);
  const double at_middle = field(middle);
  // The margin is one cell larger than the block, so that cells between two skipped blocks are clear too.
  const bool clear = std::abs(at_middle) > steepest * 0.5 * (kBlock + 1) * std::sqrt(3.0) * lattice.spacing;
  for (int z = from[2]; z < std::min(from[2] + kBlock, lattice.size[2]); ++z)
    for (int y = from[1]; y < std::min(from[1] + kBlock, lattice.size[1]); ++y)
      for (int x = from[0]; x < std::min(from[0] + kBlock, lattice.size[0]); ++x) {
        const std::size_t i = lattice.index(x, y, z);
        lattice.values[i] = float(clear ? at_middle : field(lattice.point(i)));
      }
}

/// Collects triangles. A vertex on an edge of the lattice is made only once.
class Builder {
 public:
  explicit Builder(const Lattice& lattice) : lattice_(lattice) {}

  void add(std::array<std::size_t, 4> corner) {
    // Sorts the inside corners first. An odd permutation reverses the orientation; `flip` records this.
    bool flip = false;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3 - i; ++k)
        if (!inside(corner[std::size_t(k)]) && inside(corner[std::size_t(k) + 1])) {
          std::swap(corner[std::size_t(k)], corner[std::size_t(k) + 1]);
          flip = !flip;
        }
    const auto [a, b, c, d] = corner;
    switch (inside(a) + inside(b) + inside(c) + inside(d)) {
      case 1:
        triangle(vertex(a, b), vertex(a, c), vertex(a, d), flip);
        break;
      case 2:
        triangle(vertex(a, c), vertex(a, d), vertex(b, d), flip);
        triangle(vertex(a, c), vertex(b, d), vertex(b, c), flip);
        break;
      case 3:
        triangle(vertex(a, d), vertex(b, d), vertex(c, d), flip);
        break;
      default:
        break;
    }
  }
  Mesh mesh;

 private:
  bool inside(std::size_t i) const { return lattice_.values[i] < 0; }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool flip) {
    if (flip) std::swap(b, c);
    mesh.triangles.push_back({a, b, c});
  }
  std::uint32_t vertex(std::size_t a, std::size_t b) {
    if (a > b) std::swap(a, b);
    // An edge of a tetrahedron leads to one of 7 neighbours, given by its step in x, y and z.
    const std::size_t nx = std::size_t(lattice_.size[0]), plane = nx * std::size_t(lattice_.size[1]);
    const std::size_t step = b - a;
    const std::size_t z = step >= plane, y = step - z * plane >= nx, x = step - z * plane - y * nx;
    const auto [at, is_new] =
        vertices_.try_emplace(a * 8 + (x + 2 * y + 4 * z), std::uint32_t(mesh.vertices_mm.size()));
    if (is_new) {
      const double va = lattice_.values[a], vb = lattice_.values[b];
      mesh.vertices_mm.push_back(lattice_.point(a) + va / (va - vb) * (lattice_.point(b) - lattice_.point(a)));
    }
    return at->second;
  }

  const Lattice& lattice_;
  std::unordered_map<std::size_t, std::uint32_t> vertices_;
};

}  // namespace

Mesh polygonise(const std::function<double(const Eigen::Vector3d&)>& field, const Eigen::Vector3d& low,
                const Eigen::Vector3d& high, double spacing, double steepest) {
  Lattice lattice{low, spacing, {}, {}};
  for (int k = 0; k < 3; ++k) lattice.size[std::size_t(k)] = int(std::ceil((high[k] - low[k]) / spacing)) + 1;
  const auto [nx, ny, nz] = lattice.size;
  lattice.values.resize(std::size_t(nx) * std::size_t(ny) * std::size_t(nz));
  tbb::parallel_for(0, (nz + kBlock - 1) / kBlock, [&, nx = nx, ny = ny](int block) {
    for (int y = 0; y < ny; y += kBlock)
      for (int x = 0; x < nx; x += kBlock) fill_block(lattice, field, steepest, {x, y, block * kBlock});
  });
  Builder builder(lattice);
  for (int z = 0; z + 1 < nz; ++z)
    for (int y = 0; y + 1 < ny; ++y)
      for (int x = 0; x + 1 < nx; ++x) {
        std::array<std::size_t, 8> corner;
        int inside = 0;
        for (int k = 0; k < 8; ++k) {
          corner[std::size_t(k)] = lattice.index(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
          inside += lattice.values[corner[std::size_t(k)]] < 0;
        }
        if (inside == 0 || inside == 8) continue;
        for (const auto& t : kTetrahedra)
          builder.add({corner[std::size_t(t[0])], corner[std::size_t(t[1])], corner[std::size_t(t[2])],
                       corner[std::size_t(t[3])]});
      }
  return std::move(builder.mesh);
}

}  // namespace marrow::phantom
