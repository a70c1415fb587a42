// SPDX-License-Identifier: Apache-2.0
// Checks for nodes of the kind mesh, on signed fields of known shape: a sphere, a torus, smooth bodies without
// symmetry, and fields of noise. Some grids have voxels that are not cubes, or rotated axes. Nodes that change a mesh
// get the same shapes as meshes.
#include <marrow/plugin.hpp>
#include <random>
#include <set>

#include "marrow/domain/quantile.hpp"

namespace {

using namespace marrow;
using namespace marrow::conformance;

using Distance = std::function<double(const Eigen::Vector3d&)>;
constexpr double kSphereRadius_mm = 17.3, kTorusRadius_mm = 15.2, kTubeRadius_mm = 6.4;

Grid grid_of(bool turned) {
  Grid grid;
  grid.size = {52, 56, 44};
  grid.spacing_mm = {0.9, 0.9, 1.2};
  if (turned) grid.direction = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  grid.origin_mm = Eigen::Vector3d(31, -12, 250);
  return grid;
}

Eigen::Vector3d middle(const Grid& grid) {
  return grid.point_from_index(0.5 * Eigen::Vector3d(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1) +
                               Eigen::Vector3d(0.31, -0.17, 0.23));
}

SignedField field_of(const Grid& grid, const Distance& distance) {
  SignedField field;
  field.grid = grid;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x)
        field.values_mm.push_back(
            float(std::clamp(distance(grid.point_from_index({double(x), double(y), double(z)})), -5.0, 5.0)));
  return field;
}

/// A closed surface from a function on the unit square. It is periodic in u and v. With `poles` it is periodic in u
/// only, and v = 0 and v = 1 are single points.
Mesh surface_of(const std::function<Eigen::Vector3d(double u, double v)>& point, std::uint32_t around,
                std::uint32_t along, bool poles) {
  Mesh mesh;
  const std::uint32_t rings = poles ? along - 1 : along;
  for (std::uint32_t j = 0; j < rings; ++j)
    for (std::uint32_t i = 0; i < around; ++i)
      mesh.vertices_mm.push_back(point(double(i) / around, double(poles ? j + 1 : j) / along));
  const auto at = [&](std::uint32_t i, std::uint32_t j) { return j % rings * around + i % around; };
  for (std::uint32_t j = 0; j + (poles ? 1 : 0) < rings; ++j)
    for (std::uint32_t i = 0; i < around; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  if (!poles) return mesh;
  const std::uint32_t first = std::uint32_t(mesh.vertices_mm.size()), last = first + 1;
  mesh.vertices_mm.push_back(point(0, 0));
  mesh.vertices_mm.push_back(point(0, 1));
  for (std::uint32_t i = 0; i < around; ++i) {
    mesh.triangles.push_back({first, at(i + 1, 0), at(i, 0)});
    mesh.triangles.push_back({last, at(i, rings - 1), at(i + 1, rings - 1)});
  }
  return mesh;
}

/// A shape as a field and as a mesh, with its known figures. The figures that a check does not use are 0.
struct Shape {
  Distance distance;
  Inputs inputs;
  double area_mm2, volume_mm3;
  int euler;
};

Shape sphere(bool turned = false) {
  const Grid grid = grid_of(turned);
  const Eigen::Vector3d centre = middle(grid);
  const double r = kSphereRadius_mm;
  Shape shape{[=](const Eigen::Vector3d& p) { return (p - centre).norm() - r; },
              {},
              4 * kPi * r * r,
              4.0 / 3 * kPi * r * r * r,
              2};
  shape.inputs.set("field", item(field_of(grid, shape.distance)));
  shape.inputs.set("mesh",
                   item(surface_of(
                       [=](double u, double v) {
                         return Eigen::Vector3d(centre + r * Eigen::Vector3d(std::sin(kPi * v) * std::cos(2 * kPi * u),
                                                                             std::sin(kPi * v) * std::sin(2 * kPi * u),
                                                                             -std::cos(kPi * v)));
                       },
                       240, 120, true)));
  return shape;
}

Shape torus() {
  const Grid grid = grid_of(false);
  const Eigen::Vector3d centre = middle(grid);
  const double R = kTorusRadius_mm, r = kTubeRadius_mm;
  Shape shape{[=](const Eigen::Vector3d& p) {
                const Eigen::Vector3d d = p - centre;
                return std::hypot(d.head<2>().norm() - R, d.z()) - r;
              },
              {},
              4 * kPi * kPi * R * r,
              2 * kPi * kPi * R * r * r,
              0};
  shape.inputs.set("field", item(field_of(grid, shape.distance)));
  shape.inputs.set("mesh", item(surface_of(
                               [=](double u, double v) {
                                 const double across = R + r * std::cos(2 * kPi * v);
                                 return Eigen::Vector3d(centre + Eigen::Vector3d(across * std::cos(2 * kPi * u),
                                                                                 across * std::sin(2 * kPi * u),
                                                                                 r * std::sin(2 * kPi * v)));
                               },
                               240, 120, false)));
  return shape;
}

void expect_surface(const Mesh& mesh) {
  check_mesh(mesh, "its mesh");
  expect(is_closed(mesh), "its mesh is not closed, or an edge has more or fewer than two triangles");
  expect(is_manifold(mesh), "its mesh is pinched: two sheets meet in one vertex");
}

Mesh mesh_of(const Subject& subject, const Inputs& inputs) {
  Mesh mesh = subject.output(inputs, "mesh").as<Mesh>();
  expect_surface(mesh);
  expect(enclosed_volume_mm3(mesh) > 0, "its triangles are turned inwards");
  return mesh;
}

int euler_number(const Mesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  std::set<std::uint32_t> vertices;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      edges.insert(std::minmax(t[std::size_t(k)], t[std::size_t((k + 1) % 3)]));
      vertices.insert(t[std::size_t(k)]);
    }
  return int(vertices.size()) - int(edges.size()) + int(mesh.triangles.size());
}

double topology(const Subject& subject, const Shape& shape) {
  const int found = euler_number(mesh_of(subject, shape.inputs));
  expect(found == shape.euler, formatted("Euler number {}, expected {}", found, shape.euler));
  return 0;
}

double distance_95(const Subject& subject, const Shape& shape) {
  std::vector<double> distances;
  for (const Eigen::Vector3d& point : sample_surface(mesh_of(subject, shape.inputs), 20000))
    distances.push_back(std::abs(shape.distance(point)));
  return quantile_in_place(distances, 0.95);
}

double area_error(const Subject& subject, const Shape& shape) {
  return 100 * std::abs(surface_area_mm2(mesh_of(subject, shape.inputs)) / shape.area_mm2 - 1);
}
double volume_error(const Subject& subject, const Shape& shape) {
  return 100 * std::abs(enclosed_volume_mm3(mesh_of(subject, shape.inputs)) / shape.volume_mm3 - 1);
}

/// A smooth shape without symmetry: a chain of round bodies that merge. The grid resolves it well.
Shape blobs(unsigned seed) {
  constexpr double kWidth_mm = 5, kLevel = 0.4;
  const Grid grid = grid_of(true);
  std::mt19937 random(seed);
  const auto uniform = [&random] { return 2 * (double(random()) / 4294967296.0) - 1; };
  std::vector<Eigen::Vector3d> centres{Eigen::Vector3d::Zero()};
  while (centres.size() < 9) {
    const Eigen::Vector3d step(uniform(), uniform(), uniform());
    if (step.norm() > 0.1)
      centres.push_back((centres.back() + 1.4 * kWidth_mm * step.normalized()).cwiseMax(-11).cwiseMin(11));
  }
  const auto level = [=, middle = middle(grid)](const Eigen::Vector3d& p, Eigen::Vector3d& slope) {
    double sum = 0;
    slope.setZero();
    for (const Eigen::Vector3d& centre : centres) {
      const Eigen::Vector3d from = grid.direction.transpose() * (p - middle) - centre;
      const double part = std::exp(-from.squaredNorm() / (2 * kWidth_mm * kWidth_mm));
      sum += part;
      slope += part / (kWidth_mm * kWidth_mm) * from;
    }
    return kLevel - sum;
  };
  Shape shape{[=](const Eigen::Vector3d& p) {
                Eigen::Vector3d slope;
                const double value = level(p, slope);
                return value / std::max(slope.norm(), 0.02);  // near the surface, this is a distance
              },
              {},
              0,
              0,
              0};
  shape.inputs.set("field", item(field_of(grid, shape.distance)));
  Grid fine = grid;
  for (std::size_t axis = 0; axis < 3; ++axis) fine.size[axis] *= 2;
  fine.spacing_mm /= 2;
  const SignedField samples = field_of(fine, shape.distance);
  shape.volume_mm3 = fine.spacing_mm.prod() * double(std::count_if(samples.values_mm.begin(), samples.values_mm.end(),
                                                                   [](float v) { return v < 0; }));
  return shape;
}

double worst_of_blobs(const Subject& subject, double (*figure)(const Subject&, const Shape&)) {
  double worst = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) worst = std::max(worst, figure(subject, blobs(seed)));
  return worst;
}

/// The number of fields that the node refuses. For all others it must give a closed surface. A method may refuse a
/// field that is too rough, but it must not give a surface with a hole.
double refused(const Subject& subject, const std::vector<SignedField>& fields) {
  int count = 0;
  for (const SignedField& field : fields) {
    const Result result = subject.call({{"field", item(field)}});
    if (result.refusal) {
      expect_reason(*result.refusal);
      ++count;
    } else {
      expect_surface(result.outputs.at(0).as<Mesh>());
    }
  }
  return count;
}

/// Fields of noise. Every configuration of neighbouring cells occurs in them.
std::vector<SignedField> random_fields() {
  std::vector<SignedField> fields;
  std::mt19937 random(5);
  for (int round = 0; round < 20; ++round) {
    Grid grid;
    grid.size = {9, 8, 10};
    fields.push_back(field_of(
        grid, [&](const Eigen::Vector3d&) { return double(random()) / 4294967296.0 - (round % 2 ? 0.5 : 0.3); }));
  }
  return fields;
}

/// One field for each pattern of signs at the corners of a cell. All other samples are outside; and again with all
/// other samples inside.
std::vector<SignedField> all_patterns() {
  std::vector<SignedField> fields;
  for (const bool around : {false, true})
    for (unsigned pattern = 0; pattern < 256; ++pattern) {
      Grid grid;
      grid.size = {4, 4, 4};
      fields.push_back(field_of(grid, [=](const Eigen::Vector3d& p) {
        const Eigen::Array3i corner = p.array().cast<int>() - 1;
        const bool of_cell = (corner >= 0).all() && (corner <= 1).all();
        const bool inside = of_cell ? pattern >> (corner.x() + 2 * corner.y() + 4 * corner.z()) & 1 : around;
        return inside ? -0.8 : 0.6;
      }));
    }
  return fields;
}

void validate(const Inputs&, const std::vector<PortInfo>&, const std::vector<Value>& outputs) {
  expect(outputs.size() == 1 && !outputs[0].is_absent(), "it gives no mesh");
  expect_surface(outputs[0].as<Mesh>());
}

std::vector<Trial> trials() {
  const auto constant = [](int size, float value) {
    return [=] {
      SignedField field;
      field.grid.size = {size, size, size};
      field.values_mm.assign(field.grid.count(), value);
      return Inputs{{"field", item(field)}, {"mesh", item(Mesh())}};
    };
  };
  return {{"empty_field", constant(0, 0)},
          {"one_voxel", constant(1, -1)},
          {"nothing_inside", constant(12, 3)},
          {"all_inside", constant(12, -3)},
          {"zero_everywhere", constant(12, 0)},
          {"too_few_values",
           [] {
             SignedField field = field_of(grid_of(false), [](const Eigen::Vector3d&) { return 1.0; });
             field.values_mm.pop_back();
             return Inputs{{"field", item(field)}};
           }},
          {"nan_value",
           [] {
             Inputs inputs = sphere().inputs;
             SignedField field = inputs.at("field").as<SignedField>();
             field.values_mm[field.grid.offset(20, 20, 20)] = std::nanf("");
             Mesh mesh = inputs.at("mesh").as<Mesh>();
             mesh.vertices_mm[7].x() = std::nan("");
             return Inputs{{"field", item(field)}, {"mesh", item(mesh)}};
           }},
          {"cut_by_the_border",
           [] {
             const Grid grid = grid_of(false);
             return Inputs{{"field", item(field_of(grid, [=](const Eigen::Vector3d& p) {
                              return (p - grid.origin_mm).norm() - 20;
                            }))}};
           }},
          {"large_field", [] {
             Grid grid;
             grid.size = {128, 128, 128};
             return Inputs{{"field", item(field_of(grid, [](const Eigen::Vector3d& p) {
                              return (p - Eigen::Vector3d(64, 64, 64)).norm() - 50;
                            }))}};
           }}};
}

Suite suite_of_kind() {
  Suite suite{[] { return sphere().inputs; }, validate, trials(), {}};
  const std::string voxels = " at 0.9 x 0.9 x 1.2 mm";
  suite.add("random_fields", "fields of noise: the mesh is closed and not pinched, or the node refuses with a reason",
            20, "of 20 refused", [](const Subject& subject) { return refused(subject, random_fields()); });
  suite.add("all_patterns",
            "all sign patterns of a cell: the mesh is closed and not pinched, or the node refuses with a reason", 512,
            "of 512 refused", [](const Subject& subject) { return refused(subject, all_patterns()); });
  suite.add("blobs_distance", "95th percentile of the distance to smooth shapes" + voxels, 0.15, "mm",
            [](const Subject& subject) { return worst_of_blobs(subject, distance_95); });
  suite.add("blobs_volume", "error of the volume of smooth shapes" + voxels, 1.5, "%",
            [](const Subject& subject) { return worst_of_blobs(subject, volume_error); });
  for (const auto& [name, make] : {std::pair<std::string, std::function<Shape()>>{"sphere", [] { return sphere(); }},
                                   {"turned_sphere", [] { return sphere(true); }},
                                   {"torus", torus}}) {
    suite.add(name + "_topology", "the mesh is closed, oriented, and has the right Euler number", 0, "",
              [make = make](const Subject& subject) { return topology(subject, make()); });
    suite.add(name + "_distance", "95th percentile of the distance to the true surface" + voxels, 0.15, "mm",
              [make = make](const Subject& subject) { return distance_95(subject, make()); });
    suite.add(name + "_area", "error of the area" + voxels, 1.5, "%",
              [make = make](const Subject& subject) { return area_error(subject, make()); });
    suite.add(name + "_volume", "error of the volume" + voxels, 1.5, "%",
              [make = make](const Subject& subject) { return volume_error(subject, make()); });
  }
  return suite;
}

}  // namespace

MARROW_PLUGIN(plugin) { plugin.suite("mesh", suite_of_kind()); }
