// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "marrow/base/number_text.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

py::dict dict_of(const std::vector<Metric>& metrics) {
  py::dict values;
  for (const Metric& one : metrics) values[py::str(one.name)] = one.value;
  return values;
}

py::tuple ends_of(const LineSegment& line) {
  return py::make_tuple(py::make_tuple(line.from_px[0], line.from_px[1]), py::make_tuple(line.to_px[0], line.to_px[1]));
}

LineSegment line_of(const py::handle& ends, const std::string& what) {
  const std::vector<double> numbers = numbers_of(ends, {2, 2}, what);
  LineSegment line;
  line.from_px = {numbers[0], numbers[1]};
  line.to_px = {numbers[2], numbers[3]};
  return line;
}

ShaftLines shaft_lines_of(const py::object& left, const py::object& right, double width_mm, double width_deviation_mm,
                          double log_likelihood, const py::iterable& rejected) {
  ShaftLines lines{line_of(left, "left"), line_of(right, "right"), width_mm, width_deviation_mm, log_likelihood, {}};
  for (const py::handle& pair : rejected) {
    const auto parts = pair.cast<py::tuple>();
    if (parts.size() != 3)
      throw Error(formatted("rejected: expected triples (left, right, reason), got {} items", parts.size()));
    lines.rejected.push_back({line_of(parts[0], "left of a rejected pair"),
                              line_of(parts[1], "right of a rejected pair"), py::str(parts[2])});
  }
  return lines;
}

Verdict verdict_of(const std::string& judgement, std::optional<double> failure_probability,
                   std::vector<std::string> reasons, std::vector<std::string> remedies, const Metrics& figures) {
  const std::optional<Judgement> known = judgement_named(judgement);
  if (!known) throw Error("Verdict: expected 'trusted', 'doubtful' or 'wrong', got '" + judgement + "'");
  if (failure_probability && !(*failure_probability >= 0 && *failure_probability <= 1))
    throw Error(formatted("Verdict: expected a failure_probability from 0 to 1, got {:g}", *failure_probability));
  return {*known, failure_probability.value_or(std::nan("")), std::move(reasons), std::move(remedies), figures.items};
}

EdgeMap edge_map_of(const py::handle& pixels, int width_px, int height_px) {
  const std::vector<double> numbers = numbers_of(pixels, {-1, 5}, "pixels of the edge map");
  if (width_px < 1 || height_px < 1)
    throw Error(formatted("EdgeMap: expected a width and a height of at least 1 px, got {} x {}", width_px, height_px));
  EdgeMap edges{width_px, height_px, {}};
  for (std::size_t i = 0; i < numbers.size(); i += 5) {
    const double* at = numbers.data() + i;
    const bool is_inside = at[0] >= -0.5 && at[1] >= -0.5 && at[0] <= width_px - 0.5 && at[1] <= height_px - 0.5;
    if (!is_inside || !std::isfinite(at[2] + at[3] + at[4]))
      throw Error(
          formatted("EdgeMap: pixel {} is at ({:f}, {:f}) px, outside of the image of {} x {} px, or a number of it is "
                    "not finite",
                    i / 5, at[0], at[1], width_px, height_px));
    edges.pixels.push_back({float(at[0]), float(at[1]), float(at[2]), float(at[3]), float(at[4])});
  }
  const auto place = [](const EdgePixel& pixel) { return std::pair(std::lround(pixel.v_px), std::lround(pixel.u_px)); };
  std::stable_sort(edges.pixels.begin(), edges.pixels.end(),
                   [&](const EdgePixel& a, const EdgePixel& b) { return place(a) < place(b); });
  return edges;
}

void bind_edges(py::module_& module) {
  value_class<EdgeMap>(module, "EdgeMap", "The edge pixels of one image.")
      .def(py::init(&edge_map_of), py::arg("pixels"), py::kw_only(), py::arg("width_px"), py::arg("height_px"),
           "Copies an array [edge pixel, 5]: position u and v in pixels, direction of the gradient along u and v as a "
           "unit vector, and its magnitude. The pixels are put into the order of the rows.")
      .def_readonly("width_px", &EdgeMap::width_px, "The number of columns of the image.")
      .def_readonly("height_px", &EdgeMap::height_px, "The number of rows of the image.")
      .def_property_readonly(
          "pixels",
          [](const std::shared_ptr<EdgeMap>& self) {
            static_assert(sizeof(EdgePixel) == 5 * sizeof(float));
            return array_of(self, buffer_of(reinterpret_cast<const float*>(self->pixels.data()),
                                            {py::ssize_t(self->pixels.size()), 5}));
          },
          "A read-only numpy array [edge pixel, 5], without a copy: position u and v in pixels, direction of the "
          "gradient along u and v, and its magnitude.")
      .def("__len__", [](const EdgeMap& self) { return self.pixels.size(); })
      .def("__repr__", [](const EdgeMap& self) {
        return formatted("<marrow.EdgeMap of {} pixels, {} x {} px>", self.pixels.size(), self.width_px,
                         self.height_px);
      });
  value_class<ShaftLines>(module, "ShaftLines", "The two outer borders of the shaft in one view.")
      .def(
          py::init(&shaft_lines_of), py::arg("left"), py::arg("right"), py::kw_only(), py::arg("width_mm"),
          py::arg("width_deviation_mm"), py::arg("log_likelihood") = 0.0, py::arg("rejected") = py::tuple(),
          "left, right: both ends ((u, v), (u, v)) of a border, in pixels. Both run in the same direction, and left is "
          "on the left when looking along it. rejected: triples (left, right, reason), the best ones first.")
      .def_property_readonly(
          "left", [](const ShaftLines& self) { return ends_of(self.left); },
          "Both ends ((u, v), (u, v)) of the left border, in pixels.")
      .def_property_readonly(
          "right", [](const ShaftLines& self) { return ends_of(self.right); },
          "Both ends ((u, v), (u, v)) of the right border, in pixels.")
      .def_readonly("width_mm", &ShaftLines::width_mm, "The outer diameter of the shaft.")
      .def_readonly("width_deviation_mm", &ShaftLines::width_deviation_mm, "Its standard deviation.")
      .def_readonly("log_likelihood", &ShaftLines::log_likelihood, "The score of the pair.")
      .def_property_readonly(
          "rejected",
          [](const ShaftLines& self) {
            py::list pairs;
            for (const ShaftLines::Rejected& one : self.rejected)
              pairs.append(py::make_tuple(ends_of(one.left), ends_of(one.right), one.reason));
            return pairs;
          },
          "Pairs that were rejected, the best ones first: triples of both borders and the reason in words.")
      .def("__repr__", [](const ShaftLines& self) {
        return formatted("<marrow.ShaftLines of a shaft of {} mm, deviation {} mm>", short_number(self.width_mm, 4),
                         short_number(self.width_deviation_mm));
      });
}

void bind_judgements(py::module_& module) {
  value_class<Metrics>(module, "Metrics", "Figures of merit by name, as metrics[\"mtre_mm\"].")
      .def(py::init([](const py::dict& values, const py::dict& units) {
             Metrics metrics;
             for (const auto& [name, value] : values)
               metrics.items.push_back({py::str(name),
                                        numbers_of(value, {1}, "figure '" + std::string(py::str(name)) + "'")[0],
                                        units.contains(name) ? py::str(units[name]).cast<std::string>() : ""});
             return metrics;
           }),
           py::arg("values"), py::arg("units") = py::dict(), "values: {name: number}; units: {name: unit}.")
      .def_property_readonly(
          "values", [](const Metrics& self) { return dict_of(self.items); }, "All figures, by name.")
      .def_property_readonly(
          "units",
          [](const Metrics& self) {
            py::dict units;
            for (const Metric& one : self.items) units[py::str(one.name)] = one.unit;
            return units;
          },
          "Their units, by name.")
      .def("__getitem__",
           [](const Metrics& self, const std::string& name) {
             for (const Metric& one : self.items)
               if (one.name == name) return one.value;
             throw py::key_error("no figure '" + name + "'; there are " +
                                 py::str(", ").attr("join")(dict_of(self.items)).cast<std::string>());
           })
      .def("__len__", [](const Metrics& self) { return self.items.size(); })
      .def("__iter__", [](const Metrics& self) { return py::iter(dict_of(self.items)); })
      .def("__repr__", [](const Metrics& self) {
        std::string text;
        for (const Metric& one : self.items)
          text += (text.empty() ? "" : ", ") + one.name + " = " + short_number(one.value, 6) +
                  (one.unit.empty() ? "" : " " + one.unit);
        return "<marrow.Metrics " + text + ">";
      });
  value_class<Verdict>(module, "Verdict", "Whether a pose can be relied on.")
      .def(py::init(&verdict_of), py::arg("judgement"), py::kw_only(), py::arg("failure_probability") = py::none(),
           py::arg("reasons") = std::vector<std::string>(), py::arg("remedies") = std::vector<std::string>(),
           py::arg("figures") = Metrics(),
           "judgement: \"trusted\", \"doubtful\" or \"wrong\". failure_probability: None if it is not known. reasons, "
           "the weightiest first, and remedies, which say what would settle it: in words.")
      .def_property_readonly(
          "judgement", [](const Verdict& self) { return name_of(self.judgement); },
          "\"trusted\", \"doubtful\" or \"wrong\".")
      .def_property_readonly(
          "failure_probability",
          [](const Verdict& self) -> py::object {
            if (std::isnan(self.failure_probability)) return py::none();
            return py::float_(self.failure_probability);
          },
          "The probability that the pose is off; None if it is not known.")
      .def_readonly("reasons", &Verdict::reasons, "Why, in words, the weightiest first.")
      .def_readonly("remedies", &Verdict::remedies, "What would settle it, in words.")
      .def_property_readonly(
          "figures", [](const Verdict& self) { return dict_of(self.figures); }, "What the reasons rest on, by name.")
      .def("__repr__", [](const Verdict& self) {
        const bool is_known = !std::isnan(self.failure_probability);
        return std::string("<marrow.Verdict ") + name_of(self.judgement) +
               (is_known ? ", failure " + percent_text(self.failure_probability, 0) + " %" : "") + ">";
      });
  value_class<Stop>(module, "Stop", "Whether a repetition ends after this pass.")
      .def_readonly("stops", &Stop::stops, "Whether it ends.")
      .def_readonly("reason", &Stop::reason, "Why, in words.")
      .def("__repr__", [](const Stop& self) {
        return std::string("<marrow.Stop ") + (self.stops ? "stops" : "goes on") +
               (self.reason.empty() ? "" : ": " + self.reason) + ">";
      });
}

void bind_landscape(py::module_& module) {
  py::class_<Landscape::Profile, std::shared_ptr<Landscape::Profile>>(module, "Profile",
                                                                      "The cost along one axis of the fragment.")
      .def_readonly("axis", &Landscape::Profile::axis, "\"rotation about the frontal axis\", for example.")
      .def_readonly("unit", &Landscape::Profile::unit, "The unit of the offsets: \"deg\" or \"mm\".")
      .def_property_readonly(
          "offsets",
          [](const std::shared_ptr<Landscape::Profile>& self) {
            return array_of(self, buffer_of(self->offsets.data(), {py::ssize_t(self->offsets.size())}));
          },
          "The offsets from the pose, as a read-only numpy array.")
      .def_property_readonly(
          "costs",
          [](const std::shared_ptr<Landscape::Profile>& self) {
            return array_of(self, buffer_of(self->costs.data(), {py::ssize_t(self->costs.size())}));
          },
          "The costs there, as a read-only numpy array.")
      .def_readonly("truth", &Landscape::Profile::truth, "The offset of the exact pose; None if it is not known.")
      .def("__repr__", [](const Landscape::Profile& self) {
        if (self.offsets.empty()) return "<marrow.Profile " + self.axis + ", empty>";
        return formatted("<marrow.Profile {}, {} costs from {} to {} {}>", self.axis, self.costs.size(),
                         short_number(self.offsets.front()), short_number(self.offsets.back()), self.unit);
      });
  value_class<Landscape>(module, "Landscape", "The cost around a pose, along each of the six axes of the fragment.")
      .def_property_readonly(
          "profiles",
          [](const std::shared_ptr<Landscape>& self) {
            py::list profiles;
            for (Landscape::Profile& one : self->profiles)
              profiles.append(std::shared_ptr<Landscape::Profile>(self, &one));
            return profiles;
          },
          "The profiles, one for each axis.")
      .def("__repr__",
           [](const Landscape& self) { return formatted("<marrow.Landscape of {} profiles>", self.profiles.size()); });
}

}  // namespace

void bind_findings(py::module_& module) {
  bind_edges(module);
  bind_judgements(module);
  bind_landscape(module);
  value_class<Case>(module, "Case", "One patient: a CT with seeds for each fragment, and the views.")
      .def_property_readonly(
          "ct", [](const std::shared_ptr<Case>& self) { return std::shared_ptr<Volume>(self, &self->ct); }, "The CT.")
      .def_property_readonly(
          "views", [](const Case& self) { return python_of(Value::of<View>(self.views, "view")); },
          "The views, by name; None if there are none.")
      .def_property_readonly(
          "seeds", [](const Case& self) { return python_of(Value::of<Seeds>(self.seeds, "fragment")); },
          "The seeds of each fragment; None if there are none.")
      .def_property_readonly(
          "start", [](const Case& self) { return python_of(Value::of<Pose>(self.start, "fragment")); },
          "The start poses; None if the case has none.")
      .def_property_readonly(
          "truth", [](const Case& self) { return python_of(Value::of<Truth>(self.truth, "fragment")); },
          "The exact poses; None if the case has none.")
      .def("__repr__", [](const Case& self) {
        const auto& size = self.ct.grid.size;
        return formatted("<marrow.Case of a CT of {} x {} x {}, {}, {}>", size[0], size[1], size[2],
                         counted(self.views.size(), "view"), counted(self.seeds.size(), "fragment"));
      });
}

}  // namespace marrow::python
