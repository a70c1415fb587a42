// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include <cmath>

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

void bind_edges(py::module_& module) {
  value_class<EdgeMap>(module, "EdgeMap", "The edge pixels of one image.")
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
      .def("__repr__",
           [](const EdgeMap& self) { return "<marrow.EdgeMap of " + std::to_string(self.pixels.size()) + " pixels>"; });
  value_class<ShaftLines>(module, "ShaftLines", "The two outer borders of the shaft in one view.")
      .def_property_readonly(
          "left", [](const ShaftLines& self) { return ends_of(self.left); },
          "Both ends ((u, v), (u, v)) of the left border, in pixels.")
      .def_property_readonly(
          "right", [](const ShaftLines& self) { return ends_of(self.right); },
          "Both ends ((u, v), (u, v)) of the right border, in pixels.")
      .def_readonly("width_mm", &ShaftLines::width_mm, "The outer diameter of the shaft.")
      .def_readonly("width_deviation_mm", &ShaftLines::width_deviation_mm, "Its standard deviation.");
}

void bind_judgements(py::module_& module) {
  value_class<Metrics>(module, "Metrics", "Figures of merit by name, as metrics[\"mtre_mm\"].")
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
        return "<marrow.Metrics " + py::repr(dict_of(self.items)).cast<std::string>() + ">";
      });
  value_class<Verdict>(module, "Verdict", "Whether a pose can be relied on.")
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
      .def("__repr__",
           [](const Verdict& self) { return std::string("<marrow.Verdict ") + name_of(self.judgement) + ">"; });
  value_class<Stop>(module, "Stop", "Whether a repetition ends after this pass.")
      .def_readonly("stops", &Stop::stops, "Whether it ends.")
      .def_readonly("reason", &Stop::reason, "Why, in words.");
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
      .def_readonly("truth", &Landscape::Profile::truth, "The offset of the exact pose; None if it is not known.");
  value_class<Landscape>(module, "Landscape", "The cost around a pose, along each of the six axes of the fragment.")
      .def_property_readonly(
          "profiles",
          [](const std::shared_ptr<Landscape>& self) {
            py::list profiles;
            for (Landscape::Profile& one : self->profiles)
              profiles.append(std::shared_ptr<Landscape::Profile>(self, &one));
            return profiles;
          },
          "The profiles, one for each axis.");
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
          "The exact poses; None if the case has none.");
}

}  // namespace marrow::python
