// SPDX-License-Identifier: Apache-2.0
#include "values.hpp"

#include <algorithm>
#include <cstring>

#include "marrow/base/number_text.hpp"

namespace marrow::python {
namespace {

py::module_ numpy() { return py::module_::import("numpy"); }

std::string text_of(const std::vector<py::ssize_t>& shape) {
  std::string text;
  for (const py::ssize_t length : shape)
    text += (text.empty() ? "" : " x ") + (length < 0 ? std::string("any") : formatted("{}", length));
  return text.empty() ? "one number" : text;
}

/// A masked array becomes an array with whatever is below the mask, so one with a mask is refused. Also in a list.
void expect_no_mask(const py::handle& object, const std::string& what) {
  if (py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object)) {
    for (const py::handle& item : object) expect_no_mask(item, what);
  } else if (py::hasattr(object, "mask") && py::hasattr(object, "filled")) {
    const auto masked = numpy().attr("sum")(object.attr("mask")).cast<py::ssize_t>();
    if (masked > 0)
      throw Error(formatted(
          "{}: {} masked, and a mask is not kept; give array.filled(value), which says what stands in its place", what,
          counted(masked, "of its values is", "of its values are")));
  }
}

/// The object as an array of real numbers of any type. Throws Error if it is none.
py::object real_array(const py::handle& object, const std::string& what) {
  expect_no_mask(object, what);
  const auto type_name = py::str(py::type::of(object).attr("__name__")).cast<std::string>();
  py::object array;
  try {
    array = numpy().attr("asarray")(object);
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
    throw Error(what + ": expected numbers, got " + type_name);
  }
  const auto type = py::str(array.attr("dtype")).cast<std::string>();
  const auto kind = array.attr("dtype").attr("kind").cast<std::string>();
  if (kind == "c")
    throw Error(what + ": expected real numbers, got " + type +
                ", whose imaginary parts would be lost; give array.real or numpy.abs(array)");
  if (kind.find_first_of("biuf") == std::string::npos)
    throw Error(what + ": expected numbers, got " +
                (type_name == "ndarray" ? "an array of " + type + "; convert it with array.astype(float)" : type_name));
  return array;
}

/// While it lives, numpy does not warn of numbers that change.
class QuietNumpy {
 public:
  QuietNumpy() : state_(numpy().attr("errstate")(py::arg("all") = "ignore")) { state_.attr("__enter__")(); }
  ~QuietNumpy() { state_.attr("__exit__")(py::none(), py::none(), py::none()); }
  QuietNumpy(const QuietNumpy&) = delete;
  QuietNumpy& operator=(const QuietNumpy&) = delete;

 private:
  py::object state_;
};

bool is_true(const py::object& array) { return numpy().attr("any")(array).cast<bool>(); }

/// Throws Error if numbers are others after the conversion: whole numbers that were rounded, and numbers that became
/// infinite. Fractions are rounded.
void expect_same_numbers(const py::object& array, const py::object& converted, const std::string& what) {
  const auto kind = array.attr("dtype").attr("kind").cast<std::string>();
  const auto bits = formatted("{}", 8 * converted.attr("itemsize").cast<int>());
  if (kind == "i" || kind == "u") {
    const py::object back = converted.attr("astype")(array.attr("dtype"));
    const py::object differs = numpy().attr("not_equal")(back, array);
    if (is_true(differs))
      throw Error(what + ": " + py::str(array[differs][py::int_(0)]).cast<std::string>() + " cannot be held by a " +
                  bits + "-bit floating-point number, as marrow keeps it; subtract an offset or divide first");
  } else if (kind == "f" &&
             is_true(numpy().attr("greater")(numpy().attr("isinf")(converted), numpy().attr("isinf")(array)))) {
    throw Error(what + ": a number is beyond what a " + bits + "-bit floating-point number can hold");
  }
}

}  // namespace

py::object array_of_real(const py::handle& object, const char* type, const std::string& what) {
  const py::object array = real_array(object, what);
  const QuietNumpy quiet;
  const py::object converted = numpy().attr("asarray")(array, type, "C");
  expect_same_numbers(array, converted, what);
  return converted;
}

py::buffer_info buffer_of(const cv::Mat& pixels) {
  static const char* const kFormats[] = {"B", "b", "H", "h", "i", "f", "d"};  // by cv::Mat::depth()
  std::vector<py::ssize_t> shape{pixels.rows, pixels.cols};
  std::vector<py::ssize_t> strides{py::ssize_t(pixels.step[0]), py::ssize_t(pixels.elemSize())};
  if (pixels.channels() > 1) {
    shape.push_back(pixels.channels());
    strides.push_back(py::ssize_t(pixels.elemSize1()));
  }
  return {
      pixels.data, py::ssize_t(pixels.elemSize1()), kFormats[pixels.depth()], py::ssize_t(shape.size()), shape, strides,
      true};
}

py::object array_of(std::shared_ptr<const void> owner, py::buffer_info info) {
  return numpy().attr("asarray")(py::cast(std::make_unique<Buffer>(Buffer{std::move(owner), std::move(info)})));
}

py::object array_of(const Eigen::MatrixXd& matrix) {
  const auto rows = std::make_shared<Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(matrix);
  return array_of(rows, buffer_of(rows->data(), {rows->rows(), rows->cols()})).attr("copy")();
}

py::object array_of(const RigidTransform& transform) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = transform.rotation;
  matrix.topRightCorner<3, 1>() = transform.translation_mm;
  return array_of(Eigen::MatrixXd(matrix));
}

std::vector<double> numbers_of(const py::handle& object, const std::vector<py::ssize_t>& shape,
                               const std::string& what) {
  const py::buffer array = array_of_real(object, "float64", what).cast<py::buffer>();
  py::buffer_info info = array.request();
  if (info.shape.empty()) info.shape = {1};
  const bool fits = info.shape.size() == shape.size() &&
                    std::equal(shape.begin(), shape.end(), info.shape.begin(),
                               [](py::ssize_t wanted, py::ssize_t got) { return wanted < 0 || wanted == got; });
  if (!fits) throw Error(what + ": expected " + text_of(shape) + " numbers, got " + text_of(info.shape));
  const auto* first = static_cast<const double*>(info.ptr);
  return {first, first + info.size};
}

RigidTransform transform_of(const py::handle& matrix, const std::string& target, const std::string& source,
                            const std::string& what) {
  const std::vector<double> numbers = numbers_of(matrix, {4, 4}, what);
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> values(numbers.data());
  if (values.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw Error(what + ": the last row of the matrix must be 0 0 0 1");
  RigidTransform result{target, source, values.topLeftCorner<3, 3>(), values.topRightCorner<3, 1>()};
  check_rigid(result, what);
  return result;
}

cv::Mat pixels_of(const py::handle& object, const std::string& what) {
  py::object array = real_array(object, what);
  const auto type = py::str(array.attr("dtype").attr("newbyteorder")("=")).cast<std::string>();
  int depth = type == "uint8"                          ? CV_8U
              : type == "uint16"                       ? CV_16U
              : type == "float32" || type == "float64" ? CV_32F
                                                       : -1;
  if (type == "bool") {
    array = array.attr("astype")("uint8");
    depth = CV_8U;
  }
  if (depth < 0)
    throw Error(what + ": expected pixels of type uint8, uint16 or float32, got " + type +
                "; convert them with array.astype(...)");
  const char* kept_as = depth == CV_8U ? "uint8" : depth == CV_16U ? "uint16" : "float32";
  const py::buffer same = array_of_real(array, kept_as, what).cast<py::buffer>();
  const py::buffer_info info = same.request();
  if (info.ndim != 2) throw Error(what + ": expected an array of 2 axes, rows and columns, got " + text_of(info.shape));
  return cv::Mat(int(info.shape[0]), int(info.shape[1]), CV_MAKETYPE(depth, 1), info.ptr).clone();
}

std::pair<std::vector<float>, std::vector<py::ssize_t>> samples_of(const py::handle& object, const std::string& what) {
  const py::buffer array = array_of_real(object, "float32", what).cast<py::buffer>();
  const py::buffer_info info = array.request();
  if (info.ndim != 3) throw Error(what + ": expected an array of 3 axes, z, y and x, got " + text_of(info.shape));
  const auto* first = static_cast<const float*>(info.ptr);
  return {std::vector<float>(first, first + info.size), info.shape};
}

void bind_buffer(py::module_& module) {
  module.def("array_of_real", &array_of_real, py::arg("object"), py::arg("type"), py::arg("what"),
             "An array of real numbers of a type. Raises Error if it is none or if numbers would get lost.");
  py::class_<Buffer>(module, "Buffer", py::buffer_protocol()).def_buffer([](Buffer& buffer) {
    const py::buffer_info& info = buffer.info;
    return py::buffer_info(info.ptr, info.itemsize, info.format, info.ndim, info.shape, info.strides, true);
  });
}

}  // namespace marrow::python
