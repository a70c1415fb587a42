// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>
#include <map>
#include <mutex>

#include "marrow/base/number_text.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

/// The size, the spacing and the frame of a grid; `unit` is that of its samples.
std::string text_of(const Grid& grid, const std::string& unit) {
  const Eigen::Vector3d& spacing = grid.spacing_mm;
  return formatted("{} x {} x {}, {}, spacing {} x {} x {} mm, frame '{}'", grid.size[0], grid.size[1], grid.size[2],
                   unit, short_number(spacing[0]), short_number(spacing[1]), short_number(spacing[2]), grid.frame);
}

Grid grid_of(const std::vector<py::ssize_t>& shape, const py::handle& spacing_mm, const py::handle& origin_mm,
             const py::handle& direction, const std::string& frame) {
  Grid grid;
  for (int axis = 0; axis < 3; ++axis) grid.size[std::size_t(axis)] = int(shape[std::size_t(2 - axis)]);
  grid.spacing_mm = Eigen::Vector3d(numbers_of(spacing_mm, {3}, "spacing_mm").data());
  if (!origin_mm.is_none()) grid.origin_mm = Eigen::Vector3d(numbers_of(origin_mm, {3}, "origin_mm").data());
  if (!direction.is_none())
    grid.direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
        numbers_of(direction, {3, 3}, "direction").data());
  grid.frame = frame;
  return grid;
}

template <class T>
py::buffer_info samples_buffer(const T& volume, const std::vector<float>& values) {
  const auto& size = volume.grid.size;
  return buffer_of(samples_of_item(&volume, values), {size[2], size[1], size[0]});
}

/// A value for another node: with the samples in its own list, where all nodes look for them.
template <class T>
std::optional<Value> value_with_samples(py::handle object, std::vector<float> T::*values) {
  if (!py::isinstance<T>(object)) return std::nullopt;
  const std::shared_ptr<const T> item = object.cast<std::shared_ptr<T>>();
  if (!is_mapped(item.get())) return Value::of<T>(item);
  auto whole = std::make_shared<T>(*item);
  const float* first = samples_of_item(item.get(), (*item).*values);
  ((*whole).*values).assign(first, first + whole->grid.count());
  return Value::of<T>(std::shared_ptr<const T>(whole));
}

/// What Volume and SignedField have in common.
template <class T>
void bind_grid(py::class_<T, std::shared_ptr<T>>& made, std::vector<float> T::*values) {
  conversions().back().from_python = [values](py::handle object) { return value_with_samples(object, values); };
  made.def_property_readonly(
          "array",
          [values](const std::shared_ptr<T>& self) { return array_of(self, samples_buffer(*self, (*self).*values)); },
          "The samples as a read-only numpy array [z, y, x], without a copy.")
      .def_buffer([values](T& self) { return samples_buffer(self, self.*values); })
      .def_property_readonly(
          "size", [](const T& self) { return py::make_tuple(self.grid.size[0], self.grid.size[1], self.grid.size[2]); },
          "The number of samples along x, y and z.")
      .def_property_readonly(
          "spacing_mm",
          [](const T& self) {
            return py::tuple(py::cast(
                std::array<double, 3>{self.grid.spacing_mm[0], self.grid.spacing_mm[1], self.grid.spacing_mm[2]}));
          },
          "The distances of the samples along x, y and z.")
      .def_property_readonly(
          "origin_mm",
          [](const T& self) {
            return py::tuple(py::cast(
                std::array<double, 3>{self.grid.origin_mm[0], self.grid.origin_mm[1], self.grid.origin_mm[2]}));
          },
          "The centre of the first sample, in the volume's frame.")
      .def_property_readonly(
          "direction", [](const T& self) { return array_of(Eigen::MatrixXd(self.grid.direction)); },
          "The axes of the grid in the volume's frame: the columns of a 3 x 3 array.")
      .def_property_readonly(
          "frame", [](const T& self) { return self.grid.frame; }, "The name of the frame.");
}

struct Mapped {
  std::mutex mutex;
  std::map<const void*, const float*> samples;
};

Mapped& mapped() {
  static auto* const all = new Mapped;  // outlives every Python object
  return *all;
}

}  // namespace

std::string text_of(const Image& image) {
  const int depth = image.pixels.depth();
  return formatted("{} x {} px, {}", image.width(), image.height(),
                   depth == CV_8U    ? "uint8"
                   : depth == CV_16U ? "uint16"
                                     : "float32");
}

void bind_images(py::module_& module) {
  value_class<Image>(module, "Image", py::buffer_protocol(),
                     "An X-ray image with one channel. Air is bright. numpy.asarray(image) is its pixels.")
      .def(py::init([](const py::object& array) { return std::make_shared<Image>(Image{pixels_of(array, "Image")}); }),
           py::arg("array"), "Copies an array [row, column] of type uint8, uint16 or float32; float64 becomes float32.")
      .def_property_readonly(
          "array", [](const std::shared_ptr<Image>& self) { return array_of(self, buffer_of(self->pixels)); },
          "The pixels as a read-only numpy array [row, column], without a copy.")
      .def_buffer([](Image& self) { return buffer_of(self.pixels); })
      .def_property_readonly("width", &Image::width, "The number of columns.")
      .def_property_readonly("height", &Image::height, "The number of rows.")
      .def("__repr__", [](const Image& self) { return "<marrow.Image " + text_of(self) + ">"; });
  value_class<Picture>(module, "Picture", py::buffer_protocol(), "A coloured picture for people.")
      .def_property_readonly(
          "array", [](const std::shared_ptr<Picture>& self) { return array_of(self, buffer_of(self->pixels)); },
          "The pixels as a read-only numpy array [row, column, red green blue] of uint8, without a copy.")
      .def_buffer([](Picture& self) { return buffer_of(self.pixels); })
      .def("__repr__", [](const Picture& self) {
        return formatted("<marrow.Picture {} x {} px, RGB>", self.pixels.cols, self.pixels.rows);
      });
  auto volume = value_class<Volume>(module, "Volume", py::buffer_protocol(),
                                    "A CT volume in Hounsfield units. numpy.asarray(volume) is its samples [z, y, x].");
  volume
      .def(py::init([](const py::object& array, const py::object& spacing_mm, const py::object& origin_mm,
                       const py::object& direction, const std::string& frame) {
             auto [values, shape] = samples_of(array, "Volume");
             auto made = std::make_shared<Volume>(
                 Volume{grid_of(shape, spacing_mm, origin_mm, direction, frame), std::move(values)});
             check_volume(*made, "Volume");
             return made;
           }),
           py::arg("array"), py::kw_only(), py::arg("spacing_mm"), py::arg("origin_mm") = py::none(),
           py::arg("direction") = py::none(), py::arg("frame") = "ct",
           "Copies an array [z, y, x]. spacing_mm and origin_mm are for x, y, z; the columns of direction are the axes "
           "of the grid.")
      .def("__repr__", [](const Volume& self) { return "<marrow.Volume " + text_of(self.grid, "HU") + ">"; });
  bind_grid(volume, &Volume::values);
  auto field = value_class<SignedField>(
      module, "SignedField", py::buffer_protocol(),
      "Signed distances in mm to the surface of a fragment, negative inside. numpy.asarray(field) is [z, y, x].");
  field
      .def(py::init([](const py::object& array, const py::object& spacing_mm, const py::object& origin_mm,
                       const py::object& direction, const std::string& frame) {
             auto [values, shape] = samples_of(array, "SignedField");
             Volume checked{grid_of(shape, spacing_mm, origin_mm, direction, frame), std::move(values)};
             check_volume(checked, "SignedField");
             return std::make_shared<SignedField>(SignedField{checked.grid, std::move(checked.values)});
           }),
           py::arg("array"), py::kw_only(), py::arg("spacing_mm"), py::arg("origin_mm") = py::none(),
           py::arg("direction") = py::none(), py::arg("frame") = "ct", "Copies an array [z, y, x], as Volume does.")
      .def("__repr__", [](const SignedField& self) { return "<marrow.SignedField " + text_of(self.grid, "mm") + ">"; });
  bind_grid(field, &SignedField::values_mm);
}

void note_mapped_samples(const void* item, const float* samples) {
  const std::scoped_lock lock(mapped().mutex);
  mapped().samples[item] = samples;
}

void forget_mapped_samples(const void* item) {
  const std::scoped_lock lock(mapped().mutex);
  mapped().samples.erase(item);
}

const float* samples_of_item(const void* item, const std::vector<float>& own) {
  if (!own.empty()) return own.data();
  const std::scoped_lock lock(mapped().mutex);
  const auto found = mapped().samples.find(item);
  return found == mapped().samples.end() ? own.data() : found->second;
}

bool is_mapped(const void* item) {
  const std::scoped_lock lock(mapped().mutex);
  return mapped().samples.contains(item);
}

}  // namespace marrow::python
