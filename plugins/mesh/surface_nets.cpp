// SPDX-License-Identifier: Apache-2.0
// The dual of marching cubes. In each cell, the crossings of the surface with the cell's edges form loops. Each loop
// gets one vertex. Each edge of the grid that the surface crosses gets a polygon around it. The original surface nets
// (Gibson, Constrained elastic surface nets, MICCAI 1998) have one vertex per cell. This joins sheets that only pass
// through the same cell; one vertex per loop keeps them apart.
//
// One case remains. If the surface crosses the common face of two cells twice, both crossings may join the same two
// vertices. The edge between these would have four triangles. In this case each crossing gets its own vertex on the
// face. So the surface is a closed 2-manifold for every field.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <marrow/plugin.hpp>

#include "marrow/mesh/cells.hpp"
#include "marrow/mesh/surface.hpp"

namespace {

using Eigen::Vector3d;
using marrow::Mesh, marrow::SignedField;
using marrow::surface::Signs;

struct Options : marrow::surface::Finish {
  int relaxation = 0;
};

/// The loops of each sign pattern, and the loop to which each crossed edge belongs.
struct LoopTable {
  std::array<std::vector<std::vector<int>>, 256> loops;
  std::array<std::array<std::uint8_t, 12>, 256> loop_of{};
  LoopTable() {
    for (unsigned pattern = 0; pattern < 256; ++pattern) {
      loops[pattern] = marrow::surface::cell_loops(pattern);
      for (std::size_t loop = 0; loop < loops[pattern].size(); ++loop)
        for (const int edge : loops[pattern][loop]) loop_of[pattern][std::size_t(edge)] = std::uint8_t(loop);
    }
  }
};
const LoopTable kTable;

/// Corner k of a cell's face at the low or high end of `axis`. Bit 0 of k goes along the next axis, bit 1 along the
/// axis after that.
constexpr int face_corner(int axis, bool high, int k) {
  return int(high) << axis | (k & 1) << (axis + 1) % 3 | (k >> 1) << (axis + 2) % 3;
}

/// True if the low face is crossed twice: its two inside corners lie on a diagonal.
bool crossed_twice(unsigned pattern, int axis) {
  const auto inside = [&](int k) { return pattern >> face_corner(axis, false, k) & 1; };
  return inside(0) == inside(3) && inside(1) == inside(2) && inside(0) != inside(1);
}

/// True if both crossings of such a face belong to the same loop of the cell. Opposite sides of the face belong to
/// different crossings.
bool in_one_loop(unsigned pattern, int axis, bool high) {
  const auto corner = [&](int k) { return face_corner(axis, high, k); };
  const auto& loop_of = kTable.loop_of[pattern];
  return loop_of[std::size_t(marrow::surface::edge_between(corner(0), corner(1)))] ==
         loop_of[std::size_t(marrow::surface::edge_between(corner(2), corner(3)))];
}

/// The vertices of the net in a cell: first one for each loop, then two for each low face that is split.
struct Cell {
  std::uint32_t first_vertex = 0;
  std::uint8_t pattern = 0;
  std::uint8_t split_faces = 0;  ///< low faces with two vertices of their own, one bit per axis

  std::uint32_t count() const {
    return std::uint32_t(kTable.loops[pattern].size()) + 2u * unsigned(std::popcount(split_faces));
  }
  std::uint32_t vertex_of_edge(int edge) const { return first_vertex + kTable.loop_of[pattern][std::size_t(edge)]; }
  std::uint32_t vertex_of_face(int axis, int which) const {
    const auto before = std::popcount(split_faces & ((1u << axis) - 1));
    return first_vertex + std::uint32_t(kTable.loops[pattern].size()) + 2u * unsigned(before) + unsigned(which);
  }
};

Cell cell_at(const Signs& signs, int x, int y, int z, unsigned pattern) {
  Cell cell;
  cell.pattern = std::uint8_t(pattern);
  for (int axis = 0; axis < 3; ++axis)
    if (crossed_twice(pattern, axis) && in_one_loop(pattern, axis, false) &&
        in_one_loop(signs.pattern(x - (axis == 0), y - (axis == 1), z - (axis == 2)), axis, true))
      cell.split_faces |= std::uint8_t(1u << axis);
  return cell;
}

/// All cells of one z, by x and y.
class Slice {
 public:
  Slice(const Signs& signs, int z, std::uint32_t first_vertex) : width_(signs.size()[0]) {
    cells_.resize(std::size_t(width_) * signs.size()[1]);
    for (int y = 0; y + 1 < signs.size()[1]; ++y)
      signs.for_cells(y, z, [&](int x, unsigned pattern) {
        Cell& cell = cells_[std::size_t(y) * width_ + x] = cell_at(signs, x, y, z, pattern);
        cell.first_vertex = first_vertex;
        first_vertex += cell.count();
      });
  }
  const Cell& at(int x, int y) const { return cells_[std::size_t(y) * width_ + x]; }

 private:
  int width_;
  std::vector<Cell> cells_;
};

/// Closed chains of vertices, counter-clockwise if seen from outside.
struct Polygons {
  std::vector<std::uint32_t> corners;
  std::vector<std::size_t> ends;  ///< index after the last corner of each polygon

  void add(const Polygons& others) {
    for (const std::size_t end : others.ends) ends.push_back(corners.size() + end);
    corners.insert(corners.end(), others.corners.begin(), others.corners.end());
  }
  template <class Visit>
  void for_each(const Visit& visit) const {
    std::size_t begin = 0;
    for (const std::size_t end : ends) visit(corners.data() + begin, end - begin), begin = end;
  }
};

/// Adds the polygon around the grid edge that starts at `point` and goes in +axis. The polygon connects the four cells
/// around the edge. `slices`: the slice below the point, and the slice of the point.
void add_polygon(const Slice* const slices[2], int axis, const std::array<int, 3>& point, Polygons& polygons) {
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  constexpr int kSteps[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};  // counter-clockwise about the axis
  Cell around[4];
  int start[4];  // in each cell: the corner where the edge begins
  for (int k = 0; k < 4; ++k) {
    std::array<int, 3> place = point;
    place[std::size_t(b)] += kSteps[k][0];
    place[std::size_t(c)] += kSteps[k][1];
    around[k] = slices[place[2] == point[2]]->at(place[0], place[1]);
    start[k] = -kSteps[k][0] << b | -kSteps[k][1] << c;
  }
  const bool starts_inside = around[0].pattern >> start[0] & 1;
  const std::size_t begin = polygons.corners.size();
  for (int k = 0; k < 4; ++k) {
    polygons.corners.push_back(around[k].vertex_of_edge(marrow::surface::edge_between(start[k], start[k] | 1 << axis)));
    const int owner = std::array{1, 2, 2, 3}[std::size_t(k)], face = k % 2 ? c : b;  // between this cell and the next
    if (!(around[owner].split_faces >> face & 1)) continue;
    const int inside = starts_inside ? start[owner] : start[owner] | 1 << axis;
    polygons.corners.push_back(around[owner].vertex_of_face(face, inside >> (face + 2) % 3 & 1));
  }
  if (!starts_inside) std::reverse(polygons.corners.begin() + std::ptrdiff_t(begin), polygons.corners.end());
  polygons.ends.push_back(polygons.corners.size());
}

class Net {
 public:
  explicit Net(const SignedField& field) : signs_(field), first_(std::size_t(signs_.size()[2]), 0) {
    count_vertices();
    places_.resize(first_.back());
    cells_.resize(first_.back());
    const int slices = signs_.size()[2] - 1;
    std::vector<Polygons> parts(static_cast<std::size_t>(slices));
    tbb::parallel_for(tbb::blocked_range<int>(0, slices, 8), [&](const tbb::blocked_range<int>& range) {
      Slice below(signs_, std::max(range.begin() - 1, 0), first_[std::size_t(std::max(range.begin() - 1, 0))]);
      for (int z = range.begin(); z < range.end(); ++z) {
        Slice slice(signs_, z, first_[std::size_t(z)]);
        add_polygons(below, slice, z, parts[std::size_t(z)]);
        place_vertices(slice, z);
        below = std::move(slice);
      }
    });
    for (const Polygons& part : parts) polygons_.add(part);
  }

  /// Moves each vertex to the mean of its neighbours, but keeps it in its cell.
  void relax() {
    std::vector<Vector3d> sum(places_.size(), Vector3d::Zero());
    std::vector<std::uint32_t> count(places_.size(), 0);
    polygons_.for_each([&](const std::uint32_t* corners, std::size_t size) {
      for (std::size_t k = 0; k < size; ++k) {  // each edge occurs once in each direction
        sum[corners[k]] += places_[corners[(k + 1) % size]];
        ++count[corners[k]];
      }
    });
    for (std::size_t v = 0; v < places_.size(); ++v)
      places_[v] = (sum[v] / count[v]).cwiseMax(cells_[v].low).cwiseMin(cells_[v].high);
  }

  Mesh mesh(const marrow::Grid& grid) const {
    Mesh mesh;
    mesh.frame = grid.frame;
    for (const Vector3d& place : places_) mesh.vertices_mm.push_back(grid.point_from_index(place));
    polygons_.for_each([&](const std::uint32_t* corners, std::size_t size) {
      const std::size_t from = fan_from(corners, size, mesh.vertices_mm);
      for (std::size_t k = 1; k + 1 < size; ++k)
        mesh.triangles.push_back({corners[from], corners[(from + k) % size], corners[(from + k + 1) % size]});
    });
    return mesh;
  }

 private:
  struct Box {
    Vector3d low, high;
  };

  void count_vertices() {
    std::vector<std::size_t> counts(first_.size(), 0);
    tbb::parallel_for(0, signs_.size()[2] - 1, [&](int z) {
      for (int y = 0; y + 1 < signs_.size()[1]; ++y)
        signs_.for_cells(y, z, [&](int x, unsigned pattern) {
          counts[std::size_t(z)] += cell_at(signs_, x, y, z, pattern).count();
        });
    });
    std::size_t total = 0;
    for (std::size_t z = 0; z < counts.size(); ++z) {
      first_[z] = std::uint32_t(total);
      total += counts[z];
    }
    marrow::surface::check_vertex_count(total);
  }

  void add_polygons(const Slice& below, const Slice& slice, int z, Polygons& polygons) const {
    const Slice* const slices[2] = {&below, &slice};
    for (int y = 0; y < signs_.size()[1]; ++y)
      for (int word = 0; word < signs_.words(); ++word)
        for (int axis = 0; axis < 3; ++axis)
          for (marrow::surface::Word left = signs_.edges(axis, word, y, z); left; left &= left - 1)
            add_polygon(slices, axis, {64 * word + std::countr_zero(left), y, z}, polygons);
  }

  /// The vertex of a loop is the mean of its crossings. A vertex of a face is the mean of the two crossings next to an
  /// inside corner.
  void place_vertices(const Slice& slice, int z) {
    for (int y = 0; y + 1 < signs_.size()[1]; ++y)
      signs_.for_cells(y, z, [&](int x, unsigned pattern) {
        const Cell& cell = slice.at(x, y);
        const auto crossing = [&](int edge) {
          const int start = marrow::surface::kEdgeStart[std::size_t(edge)];
          return signs_.crossing(edge / 4, x + (start & 1), y + (start >> 1 & 1), z + (start >> 2));
        };
        const Vector3d low(x - 1, y - 1, z - 1);
        const Box box{low, low + Vector3d::Ones()};
        std::uint32_t vertex = cell.first_vertex;
        for (const std::vector<int>& loop : kTable.loops[pattern]) {
          Vector3d sum = Vector3d::Zero();
          for (const int edge : loop) sum += crossing(edge);
          cells_[vertex] = box;
          places_[vertex++] = sum / double(loop.size());
        }
        for (int axis = 0; axis < 3; ++axis) {
          if (!(cell.split_faces >> axis & 1)) continue;
          for (int k = 0; k < 4; ++k) {
            const int corner = face_corner(axis, false, k);
            if (!(pattern >> corner & 1)) continue;
            cells_[vertex] = box;
            cells_[vertex].high[axis] = low[axis];
            places_[vertex++] = (crossing(marrow::surface::edge_between(corner, face_corner(axis, false, k ^ 1))) +
                                 crossing(marrow::surface::edge_between(corner, face_corner(axis, false, k ^ 2)))) /
                                2;
          }
        }
      });
  }

  /// The corner at which the polygon's fan of triangles starts. A quadrilateral is cut along its shorter diagonal. A
  /// larger polygon starts at a face's vertex, because the neighbours of this vertex must not be joined by a second
  /// edge.
  std::size_t fan_from(const std::uint32_t* corners, std::size_t size, const std::vector<Vector3d>& at) const {
    if (size == 4)
      return (at[corners[0]] - at[corners[2]]).squaredNorm() <= (at[corners[1]] - at[corners[3]]).squaredNorm() ? 0 : 1;
    for (std::size_t k = 0; k < size; ++k)
      if ((cells_[corners[k]].high - cells_[corners[k]].low).minCoeff() == 0) return k;
    return 0;
  }

  Signs signs_;
  std::vector<std::uint32_t> first_;  ///< first vertex of each slice
  std::vector<Vector3d> places_;      ///< positions of the vertices, in index coordinates
  std::vector<Box> cells_;            ///< the box that each vertex must not leave
  Polygons polygons_;
};

Mesh surface_nets(const SignedField& field, const Options& options, marrow::Context& context) {
  Net net(field);
  for (int step = 0; step < options.relaxation; ++step) {
    context.check_cancelled();
    net.relax();
  }
  return marrow::surface::finish(net.mesh(field.grid), options);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mesh.surface_nets", surface_nets)
      .summary(
          "Surface nets (after Gibson, MICCAI 1998), the dual of marching cubes; the surface is closed for every field")
      .in("field", "signed distance, negative inside")
      .out("mesh", "closed surface of the field's zero level, normals outward")
      .option(
          "relaxation", &Options::relaxation,
          "how often each vertex moves to the mean of its neighbours, within its cell; useful for fields with steps",
          marrow::at_least(0), marrow::at_most(200))
      .option("largest_only", &Options::largest_only, marrow::surface::kLargestOnlyHelp)
      .option("smoothing", &Options::smoothing, marrow::surface::kSmoothingHelp, marrow::at_least(0),
              marrow::at_most(200));
}
