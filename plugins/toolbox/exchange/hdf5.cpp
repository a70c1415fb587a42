// SPDX-License-Identifier: Apache-2.0
#include "hdf5.hpp"

#include <array>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::exchange {
namespace {

constexpr std::size_t kLongestText = 4096;
constexpr std::size_t kMostNames = 10000;

/// Opens a regular file without locking it. HDF5 prints its errors unless it is told not to.
hid_t open_file(const std::filesystem::path& path) {
  const files::InputFile checked(path);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const Hdf5Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(access, false, true);
  return H5Fopen(path.c_str(), H5F_ACC_RDONLY, access);
}

hid_t create_in_memory() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const Hdf5Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access, 1 << 16, false);
  return H5Fcreate("marrow-in-memory", H5F_ACC_TRUNC, H5P_DEFAULT, access);
}

void check(bool good) {
  if (!good) throw Error("HDF5 cannot make the file; is there enough memory?");
}

}  // namespace

Hdf5Reader::Hdf5Reader(const std::filesystem::path& path) : path_(path.string()), file_(open_file(path), H5Fclose) {
  if (!file_.is_open())
    throw Error(path_ +
                ": is no HDF5 file that can be opened; it is cut off, damaged or of another kind: write it again");
}

void Hdf5Reader::refuse(const std::string& key, const std::string& what) const {
  throw Error(path_ + ": " + printable(key) + ": " + what);
}

bool Hdf5Reader::has(const std::string& key) const {
  if (key == "/") return true;
  // Asks for each group on the way, because HDF5 reports an error if one is missing. A link may lead to another file.
  for (std::size_t at = key.find('/', 1);; at = key.find('/', at + 1)) {
    const std::string part = key.substr(0, at);
    if (H5Lexists(file_, part.c_str(), H5P_DEFAULT) <= 0) return false;
    H5L_info_t info{};
    if (H5Lget_info(file_, part.c_str(), &info, H5P_DEFAULT) < 0 || info.type != H5L_TYPE_HARD)
      refuse(part, "is a link to another place, which is not followed; copy what it leads to into the file");
    if (at == std::string::npos) return true;
  }
}

void Hdf5Reader::check_is_inside(hid_t data, const std::string& key) const {
  const Hdf5Id how(H5Dget_create_plist(data), H5Pclose);
  if (!how.is_open() || H5Pget_external_count(how) != 0 || H5Pget_layout(how) == H5D_VIRTUAL)
    refuse(key, "its values lie in another file, which is not read; copy them into the file");
}

std::vector<std::string> Hdf5Reader::names_in(const std::string& key) const {
  std::vector<std::string> names;
  if (!has(key)) return names;
  const Hdf5Id group(H5Gopen2(file_, key.c_str(), H5P_DEFAULT), H5Gclose);
  H5G_info_t info{};
  if (!group.is_open() || H5Gget_info(group, &info) < 0) refuse(key, "expected a group; the file is damaged");
  if (info.nlinks > kMostNames) refuse(key, formatted("has {} items; at most {} are read", info.nlinks, kMostNames));
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    std::array<char, 256> name{};
    const ssize_t length =
        H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size(), H5P_DEFAULT);
    if (length <= 0 || std::size_t(length) >= name.size()) refuse(key, "has a name that is damaged or too long");
    names.emplace_back(name.data());
  }
  return names;
}

void Hdf5Reader::read(const std::string& key, hid_t memory, std::size_t count, void* values) const {
  if (!has(key)) refuse(key, "is missing; the file is cut off, or of another kind: write it again");
  const Hdf5Id data(H5Dopen2(file_, key.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Id space(data.is_open() ? H5Dget_space(data) : -1, H5Sclose),
      type(data.is_open() ? H5Dget_type(data) : -1, H5Tclose);
  if (!space.is_open() || !type.is_open()) refuse(key, "expected numbers; the file is damaged");
  check_is_inside(data, key);
  const H5T_class_t kind = H5Tget_class(type);
  if (kind != H5T_FLOAT && kind != H5T_INTEGER) refuse(key, "expected numbers, got another type");
  const hssize_t found = H5Sget_simple_extent_npoints(space);
  if (found != hssize_t(count)) refuse(key, formatted("expected {}, got {}", counted(count, "number"), found));
  if (H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
    refuse(key, "cannot be read; the file is damaged");
}

std::vector<double> Hdf5Reader::numbers(const std::string& key, std::size_t count) const {
  std::vector<double> values(count);
  read(key, H5T_NATIVE_DOUBLE, count, values.data());
  for (const double value : values)
    if (!std::isfinite(value)) refuse(key, formatted("expected finite numbers, got {:f}", value));
  return values;
}

std::vector<std::size_t> Hdf5Reader::shape(const std::string& key) const {
  if (!has(key)) refuse(key, "is missing; the file is cut off, or of another kind: write it again");
  const Hdf5Id data(H5Dopen2(file_, key.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Id space(data.is_open() ? H5Dget_space(data) : -1, H5Sclose);
  std::array<hsize_t, H5S_MAX_RANK> lengths{};
  const int rank = space.is_open() ? H5Sget_simple_extent_dims(space, lengths.data(), nullptr) : -1;
  if (rank < 0) refuse(key, "expected numbers; the file is damaged");
  return {lengths.begin(), lengths.begin() + rank};
}

std::vector<float> Hdf5Reader::floats(const std::string& key, std::size_t count) const {
  // The shape is compared before memory for it is taken.
  std::size_t found = 1;
  for (const std::size_t length : shape(key)) found *= length;
  if (found != count) refuse(key, formatted("expected {}, got {}", counted(count, "number"), found));
  std::vector<float> values(count);
  read(key, H5T_NATIVE_FLOAT, count, values.data());
  for (const float value : values)
    if (!std::isfinite(value)) refuse(key, "expected finite numbers, got " + formatted("{:f}", double(value)));
  return values;
}

std::string Hdf5Reader::text(const std::string& key) const {
  if (!has(key)) refuse(key, "is missing; the file is cut off, or of another kind: write it again");
  const Hdf5Id data(H5Dopen2(file_, key.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Id space(data.is_open() ? H5Dget_space(data) : -1, H5Sclose),
      type(data.is_open() ? H5Dget_type(data) : -1, H5Tclose);
  if (!space.is_open() || !type.is_open() || H5Tget_class(type) != H5T_STRING ||
      H5Sget_simple_extent_npoints(space) != 1)
    refuse(key, "expected a text, got another type");
  check_is_inside(data, key);
  if (H5Tis_variable_str(type) > 0) {
    char* found = nullptr;
    const Hdf5Id memory(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(memory, H5T_VARIABLE);
    H5Tset_cset(memory, H5Tget_cset(type));
    if (H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, &found) < 0 || !found)
      refuse(key, "cannot be read; the file is damaged");
    const std::string text(found, strnlen(found, kLongestText));
    H5free_memory(found);
    return text;
  }
  const std::size_t size = H5Tget_size(type);
  if (size == 0 || size > kLongestText) refuse(key, "expected a short text; the file is damaged");
  std::string text(size, '\0');
  if (H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) < 0)
    refuse(key, "cannot be read; the file is damaged");
  return text.substr(0, text.find('\0'));
}

Hdf5Writer::Hdf5Writer() : file_(create_in_memory(), H5Fclose) { check(file_.is_open()); }

void Hdf5Writer::group(const std::string& key) {
  const Hdf5Id group(H5Gcreate2(file_, key.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  check(group.is_open());
}

void Hdf5Writer::attribute(const std::string& key, const std::string& name, const std::string& value) {
  const Hdf5Id type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(type, value.size());
  const Hdf5Id attribute(
      H5Acreate_by_name(file_, key.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  check(attribute.is_open() && H5Awrite(attribute, type, value.data()) >= 0);
}

void Hdf5Writer::dataset(const std::string& key, hid_t type, hid_t space, const void* values) {
  const Hdf5Id properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(properties, false);  // the same values give the same bytes
  const Hdf5Id data(H5Dcreate2(file_, key.c_str(), type, space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose);
  check(data.is_open() && H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
}

void Hdf5Writer::text(const std::string& key, const std::string& value) {
  const Hdf5Id type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(type, value.size());
  dataset(key, type, space, value.data());
}

void Hdf5Writer::whole_number(const std::string& key, unsigned long value) {
  const Hdf5Id space(H5Screate(H5S_SCALAR), H5Sclose);
  dataset(key, H5T_NATIVE_ULONG, space, &value);
}

void Hdf5Writer::number(const std::string& key, double value) {
  const Hdf5Id space(H5Screate(H5S_SCALAR), H5Sclose);
  dataset(key, H5T_NATIVE_DOUBLE, space, &value);
}

void Hdf5Writer::matrix(const std::string& key, const std::vector<double>& values, std::size_t rows,
                        std::size_t columns) {
  const hsize_t shape[2] = {rows, columns};
  const Hdf5Id space(H5Screate_simple(2, shape, nullptr), H5Sclose);
  dataset(key, H5T_NATIVE_DOUBLE, space, values.data());
}

std::string Hdf5Writer::bytes() const {
  check(H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0);
  const ssize_t size = H5Fget_file_image(file_, nullptr, 0);
  check(size > 0);
  std::string bytes(std::size_t(size), '\0');
  check(H5Fget_file_image(file_, bytes.data(), bytes.size()) == size);
  return bytes;
}

}  // namespace marrow::exchange
