// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's surface mesher is under the GPL, version 3 or later. So is the code that is linked to it: this file, its
// header and the plugin plugins/mesh/delaunay.cpp. The rest of marrow only loads this plugin.
#include "delaunay_refinement.hpp"

#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_with_circumcenter_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Robust_circumcenter_traits_3.h>
#include <CGAL/Surface_mesh_cell_base_3.h>
#include <CGAL/Surface_mesh_default_criteria_3.h>
#include <CGAL/Surface_mesh_vertex_base_3.h>
#include <CGAL/make_surface_mesh.h>

#include <map>

namespace marrow::delaunay {
namespace {

/// Numbers vertices and cells in the order of their creation. Otherwise CGAL sorts them by address, and the same field
/// could give different meshes in different runs.
template <class Base>
class Numbered : public Base {
 public:
  using Base::Base;
  using Has_timestamp = CGAL::Tag_true;
  template <class Structure>
  struct Rebind_TDS {
    using Other = Numbered<typename Base::template Rebind_TDS<Structure>::Other>;
  };
  std::size_t time_stamp() const { return stamp_; }
  void set_time_stamp(const std::size_t& stamp) { stamp_ = stamp; }

 private:
  std::size_t stamp_ = std::size_t(-1);
};

// Like CGAL::Surface_mesh_default_triangulation_3, but numbered.
using Kernel = CGAL::Robust_circumcenter_traits_3<CGAL::Exact_predicates_inexact_constructions_kernel>;
using Vertex = Numbered<CGAL::Surface_mesh_vertex_base_3<Kernel>>;
using Cell = Numbered<
    CGAL::Delaunay_triangulation_cell_base_with_circumcenter_3<Kernel, CGAL::Surface_mesh_cell_base_3<Kernel>>>;
using Triangulation = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<Vertex, Cell>>;
using Complex = CGAL::Surface_mesh_complex_2_in_triangulation_3<Triangulation>;
using Point = Kernel::Point_3;
using Implicit = CGAL::Implicit_surface_3<Kernel, std::function<double(Point)>>;
using Traits = CGAL::Surface_mesh_traits_generator_3<Implicit>::type;
using Limits = CGAL::Surface_mesh_default_criteria_3<Triangulation>;
using Mesher = CGAL::Surface_mesher_generator<Complex, Traits, Limits, CGAL::Manifold_tag,
                                              CGAL::Surface_mesher::NOT_VERBOSE>::type;

/// The facets of the complex as triangles. The line between the circumcentres of a facet's two cells crosses the level
/// set, so one of them lies inside. Seen from the other cell, the facet's corners are counter-clockwise.
Surface facets_of(const Complex& complex, const Implicit& implicit) {
  const Triangulation& triangulation = complex.triangulation();
  Surface surface;
  std::map<Triangulation::Vertex_handle, std::uint32_t> index;
  const auto index_of = [&](const Triangulation::Vertex_handle& vertex) {
    const auto [place, added] = index.try_emplace(vertex, std::uint32_t(surface.vertices_mm.size()));
    if (added) surface.vertices_mm.emplace_back(vertex->point().x(), vertex->point().y(), vertex->point().z());
    return place->second;
  };
  for (auto facet = complex.facets_begin(); facet != complex.facets_end(); ++facet) {
    Triangulation::Facet from = *facet;
    const auto is_inside = [&](const Triangulation::Facet& side) {
      return !triangulation.is_infinite(side.first) && implicit(triangulation.dual(side.first)) < 0;
    };
    if (is_inside(from)) from = triangulation.mirror_facet(from);
    std::array<std::uint32_t, 3> triangle;
    for (int k = 0; k < 3; ++k)
      triangle[std::size_t(k)] = index_of(from.first->vertex(Triangulation::vertex_triple_index(from.second, k)));
    surface.triangles.push_back(triangle);
  }
  return surface;
}

}  // namespace

Surface mesh(const LevelSet& level_set, const Criteria& criteria, const std::function<void()>& step) {
  const auto value = [&](const Point& p) { return level_set.value({p.x(), p.y(), p.z()}); };
  constexpr double kRelativeError = 1e-7;  // position error of points on the level set, relative to the ball's radius
  const Implicit implicit(value, Kernel::Sphere_3(CGAL::ORIGIN, level_set.radius_mm * level_set.radius_mm),
                          kRelativeError);
  Triangulation triangulation;
  for (const Eigen::Vector3d& p : level_set.points_mm) triangulation.insert(Point(p.x(), p.y(), p.z()));
  if (triangulation.dimension() < 3) return {{}, {}, true};  // too few points to begin with
  Complex complex(triangulation);
  const Traits traits;
  const Limits limits(criteria.angle_deg, criteria.size_mm, criteria.distance_mm);
  Mesher mesher(complex, implicit, traits, limits);
  mesher.init();
  constexpr int kPointsBetweenSteps = 1000;
  CGAL::Null_mesh_visitor visitor;
  bool complete = mesher.is_algorithm_done();
  while (!complete && triangulation.number_of_vertices() < criteria.most_points) {
    step();
    for (int i = 0; i < kPointsBetweenSteps && !complete; ++i) complete = !mesher.one_step(visitor);
  }
  Surface surface = facets_of(complex, implicit);
  surface.complete = complete;
  return surface;
}

}  // namespace marrow::delaunay
