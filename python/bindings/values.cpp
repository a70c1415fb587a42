// SPDX-License-Identifier: Apache-2.0
#include "values.hpp"

#include <pybind11/stl.h>

#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::python {
namespace {

std::string type_name(const py::handle& object) {
  return py::str(py::type::of(object).attr("__name__")).cast<std::string>();
}

bool is_array(const py::handle& object) { return py::hasattr(object, "__array_interface__"); }

/// What to write for an array where a port takes another type.
std::string advice_for_array(const std::string& type) {
  if (type == "volume" || type == "signed_field")
    return "; an array has no spacing: give marrow." + std::string(type == "volume" ? "Volume" : "SignedField") +
           "(array, spacing_mm=(x, y, z))";
  if (type == "view") return "; an array has no camera: give marrow.View(array, camera)";
  if (type == "pose") return "; give marrow.Pose(matrix)";
  return "";
}

Value list_of(const std::vector<std::string>& names, const std::vector<py::object>& objects, const std::string& axis,
              const TypeInfo& type, const std::string& what) {
  if (objects.empty()) throw Error(what + ": the list is empty; leave it out, or give it an item");
  Value list;
  list.axis = axis;
  list.names = names;
  for (const py::object& object : objects) {
    check_item_name("list item of " + what, list.names[list.items.size()]);
    list.items.push_back(value_of(object, type, "", what));
    list.type = list.items.back().type;
    if (list.type != list.items[0].type)
      throw Error(what + ": the items of a list must have one type, got " + list.items[0].type.id + " and " +
                  list.type.id);
  }
  return list;
}

std::string name_of_item(const py::handle& object, std::size_t index) {
  if (py::isinstance<View>(object)) return object.cast<const View&>().name;
  if (py::isinstance<Seeds>(object)) return object.cast<const Seeds&>().fragment;
  return formatted("{}", index + 1);
}

}  // namespace

std::vector<Conversion>& conversions() {
  static std::vector<Conversion> all;
  return all;
}

std::vector<FunctionClass>& function_classes() {
  static std::vector<FunctionClass> all;
  return all;
}

std::optional<Value> known_value(const py::handle& object) {
  for (const Conversion& one : conversions())
    if (auto value = one.from_python(object)) return value;
  if (py::isinstance<OtherValue>(object)) return object.cast<const OtherValue&>().value;
  return std::nullopt;
}

py::object python_of(const Value& value) {
  if (value.is_list()) {
    py::list items;
    for (const Value& item : value.items) items.append(python_of(item));
    return py::module_::import("marrow.items").attr("Items")(value.axis, value.names, items);
  }
  if (value.is_absent() || !value.data) return py::none();
  for (const Conversion& one : conversions())
    if (one.type == value.type) return one.to_python(value.data);
  for (const FunctionClass& one : function_classes())
    if (one.type == value.type) return one.to_python(value);
  return py::cast(OtherValue{value});
}

Value value_of(const py::handle& object, const TypeInfo& type, const std::string& axis, const std::string& what) {
  if (auto value = known_value(object)) return *value;
  const std::string axis_here = !axis.empty() ? axis : type.id == "view" ? "view" : "item";
  if (py::hasattr(object, "items") && py::hasattr(object, "keys")) {
    std::vector<std::string> names;
    std::vector<py::object> objects;
    for (const py::handle& key : object.attr("keys")()) {
      names.push_back(py::str(key).cast<std::string>());
      objects.push_back(object.attr("__getitem__")(key));
    }
    const std::string own = py::hasattr(object, "axis") ? object.attr("axis").cast<std::string>() : axis_here;
    return list_of(names, objects, own, type, what);
  }
  if (py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object)) {
    std::vector<std::string> names;
    std::vector<py::object> objects;
    for (const py::handle& item : object) {
      names.push_back(name_of_item(item, objects.size()));
      objects.push_back(py::reinterpret_borrow<py::object>(item));
    }
    return list_of(names, objects, axis_here, type, what);
  }
  if (is_array(object) && type.id == "image")
    return Value::of<Image>(std::make_shared<const Image>(Image{pixels_of(object, what)}));
  throw Error(what + ": expected " + type.id + ", got " + type_name(object) +
              (is_array(object) ? advice_for_array(type.id) : ""));
}

void bind_values(py::module_& module) {
  py::class_<OtherValue> other(module, "OtherValue",
                               "A value without a class of its own in Python, of a type of a plugin. It can be given "
                               "to another node.");
  add_copies(other);
  other
      .def_property_readonly(
          "type", [](const OtherValue& other) { return other.value.type.id; },
          "The name of the type, as messages show it.")
      .def("__repr__", [](const OtherValue& other) { return "<marrow " + other.value.type.id + ">"; });
  module.def(
      "digest_of",
      [](const py::object& object) -> std::optional<std::string> {
        const std::optional<Value> value = known_value(object);
        if (!value || !value->type.content) return std::nullopt;
        return value->type.content->hash(value->data.get()).hex();
      },
      py::arg("value"),
      "A text that is the same for values of the same content, of types of plugins too. None for functions, lists and "
      "what is no value of marrow.");
}

}  // namespace marrow::python
