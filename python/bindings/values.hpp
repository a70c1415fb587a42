// SPDX-License-Identifier: Apache-2.0
#pragma once
// marrow's values as Python objects, and back. A Python object shares the value's data, and nobody can change them.
#include <pybind11/pybind11.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow::python {

/// A value of a type that has no class in Python: a function, such as a cost, or a type of a plugin's own.
struct OtherValue {
  Value value;
};

struct Conversion {
  TypeInfo type;
  std::function<py::object(const std::shared_ptr<const void>& data)> to_python;
  std::function<std::optional<Value>(py::handle object)> from_python;
};
std::vector<Conversion>& conversions();

/// The Python class of functions of one type. It is derived from OtherValue.
struct FunctionClass {
  TypeInfo type;
  py::object (*to_python)(const Value& value);
};
std::vector<FunctionClass>& function_classes();

/// How a value is pickled: unpickled() and its arguments. Throws Error for functions, and for types of plugins.
py::tuple pickled(const py::object& object);

/// Values do not change, so a copy is the value itself.
template <class Class>
void add_copies(Class& made) {
  made.def("__copy__", [](const py::object& self) { return self; })
      .def("__deepcopy__", [](const py::object& self, const py::object&) { return self; })
      .def("__reduce__", &pickled);
}

/// Declares the Python class of a value type.
template <class T, class... Extra>
py::class_<T, std::shared_ptr<T>> value_class(py::module_& module, const char* name, const Extra&... extra) {
  conversions().push_back({TypeInfo::of<T>(),
                           [](const std::shared_ptr<const void>& data) {
                             return py::cast(std::const_pointer_cast<T>(std::static_pointer_cast<const T>(data)));
                           },
                           [](py::handle object) -> std::optional<Value> {
                             if (!py::isinstance<T>(object)) return std::nullopt;
                             return Value::of<T>(std::shared_ptr<const T>(object.cast<std::shared_ptr<T>>()));
                           }});
  py::class_<T, std::shared_ptr<T>> made(module, name, extra...);
  made.attr("type") = TypeInfo::of<T>().id;
  add_copies(made);
  return made;
}

/// The value that an object stands for; nothing if it is no value of a type that marrow knows.
std::optional<Value> known_value(const py::handle& object);

/// None for an absent value, marrow.Items for a list.
py::object python_of(const Value& value);

/// The value of an object for a port. A list or dictionary becomes a list over the axis of the port, or, if the port
/// takes one item, over "view" for views and over "item" for others. Throws Error if the object is no value of a type
/// that marrow knows. `what` names the port in the message ("input 'view'").
Value value_of(const py::handle& object, const TypeInfo& type, const std::string& axis, const std::string& what);

/// "512 x 512 px, uint16".
std::string text_of(const Image& image);

/// Image, Picture, Volume, SignedField.
void bind_images(py::module_& module);
/// Transform, Camera, View, Mesh, Pose, Truth, Seeds, Landmarks, Scene.
void bind_geometry(py::module_& module);
/// What nodes find: edges, shaft lines, figures, verdicts, landscapes.
void bind_findings(py::module_& module);
/// OtherValue.
void bind_values(py::module_& module);
/// What pickle, save and load need.
void bind_files(py::module_& module);
/// Cost, Optimizer, OutlineProjector, RadiographProjector; after bind_values().
void bind_functions(py::module_& module);
/// Functions that a node written in Python takes; after bind_functions().
void bind_asked(py::module_& module);
/// What processes of nodes written in Python need.
void bind_worker(py::module_& module);

}  // namespace marrow::python
