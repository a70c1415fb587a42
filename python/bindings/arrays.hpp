// SPDX-License-Identifier: Apache-2.0
#pragma once
// Memory of marrow's values as numpy arrays, and back. Only the buffer protocol is used, so that any version of numpy
// fits.
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "marrow/domain/transform.hpp"

namespace marrow::python {

namespace py = pybind11;

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

}  // namespace marrow::python
