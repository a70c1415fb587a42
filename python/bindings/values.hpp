// SPDX-License-Identifier: Apache-2.0
#pragma once
// marrow's values as Python objects, and back. A Python object shares the value's data, and nobody can change them.
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/node/types.hpp"

namespace marrow::python {

namespace py = pybind11;

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

// Memory of marrow's values as numpy arrays, and back. Only the buffer protocol is used, so that any version of numpy
// fits.

/// A piece of memory as numpy sees it. It keeps the memory's owner alive.
struct Buffer {
  std::shared_ptr<const void> owner;
  py::buffer_info info;
};

/// The same for memory of `shape`, of which the last axis runs fastest.
template <class T>
py::buffer_info buffer_of(const T* data, std::vector<py::ssize_t> shape) {
  std::vector<py::ssize_t> strides(shape.size());
  py::ssize_t stride = sizeof(T);
  for (std::size_t i = shape.size(); i-- > 0; stride *= shape[i]) strides[i] = stride;
  return {
      const_cast<T*>(data), sizeof(T), py::format_descriptor<T>::format(), py::ssize_t(shape.size()), std::move(shape),
      std::move(strides),   true};
}
py::buffer_info buffer_of(const cv::Mat& pixels);

/// A read-only numpy array of this memory, without a copy.
py::object array_of(std::shared_ptr<const void> owner, py::buffer_info info);
/// A numpy array with a copy of the numbers, which the caller may change.
py::object array_of(const Eigen::MatrixXd& matrix);
/// The 4 x 4 matrix of a transform.
py::object array_of(const RigidTransform& transform);

/// Anything that numpy takes as an array of real numbers, as an array of this type in C order. Throws Error if it is
/// none, or if numbers would get lost or change: masked ones, complex ones, whole numbers that the type cannot hold.
/// `what` names it in the message.
py::object array_of_real(const py::handle& object, const char* type, const std::string& what);
/// The numbers of anything that numpy takes as an array of this shape; -1 stands for any length. Throws Error if the
/// shape is another or a number is not one. `what` names it in the message.
std::vector<double> numbers_of(const py::handle& object, const std::vector<py::ssize_t>& shape,
                               const std::string& what);
/// The rotation and translation of a 4 x 4 matrix. Throws Error if it is not rigid.
RigidTransform transform_of(const py::handle& matrix, const std::string& target, const std::string& source,
                            const std::string& what);
/// A copy of an array of 2 axes as pixels of 8 or 16 bits or 32-bit floating point. float64 becomes float32. Throws
/// Error for other types and shapes.
cv::Mat pixels_of(const py::handle& object, const std::string& what);
/// A copy of an array as 32-bit numbers, and its shape of 3 axes. Throws Error for other shapes.
std::pair<std::vector<float>, std::vector<py::ssize_t>> samples_of(const py::handle& object, const std::string& what);

void bind_buffer(py::module_& module);

// Volumes and signed fields whose samples are not in the object itself, but in memory that was mapped.

/// From now on, the samples of this Volume or SignedField, whose own list is empty, are at `samples`.
void note_mapped_samples(const void* item, const float* samples);
void forget_mapped_samples(const void* item);

/// The samples of a Volume or SignedField, wherever they are.
const float* samples_of_item(const void* item, const std::vector<float>& own);

/// Whether the samples are elsewhere.
bool is_mapped(const void* item);

}  // namespace marrow::python
