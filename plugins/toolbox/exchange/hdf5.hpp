// SPDX-License-Identifier: Apache-2.0
#pragma once
// HDF5 files: numbers, texts, groups and arrays by their keys. Only arrays that are asked for with their shape cost
// much memory. Files to be written are made in memory.
#include <hdf5.h>

#include <filesystem>
#include <string>
#include <vector>

namespace marrow::exchange {

/// An open HDF5 object, which is closed at the end.
class Hdf5Id {
 public:
  Hdf5Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Hdf5Id() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Id(const Hdf5Id&) = delete;
  Hdf5Id& operator=(const Hdf5Id&) = delete;
  operator hid_t() const { return id_; }
  bool is_open() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

class Hdf5Reader {
 public:
  /// Throws Error if the file cannot be read, or is not HDF5.
  explicit Hdf5Reader(const std::filesystem::path& path);

  /// Throws Error if a part of the key is a link, because it could lead to a file that nobody named.
  bool has(const std::string& key) const;
  /// The names in a group, in their order; empty if there is no such group.
  std::vector<std::string> names_in(const std::string& key) const;
  /// The values of a dataset. Throw Error if there is no such dataset, or if it does not hold `count` finite numbers or
  /// one text.
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  double number(const std::string& key) const { return numbers(key, 1)[0]; }
  std::string text(const std::string& key) const;
  /// The lengths of a dataset, the slowest axis first. Throws Error if there is no such dataset.
  std::vector<std::size_t> shape(const std::string& key) const;
  /// All values of a dataset of numbers, converted to float; the last axis runs fastest. Throws Error if there is no
  /// such dataset, if it does not have `count` values, or if one is not finite.
  std::vector<float> floats(const std::string& key, std::size_t count) const;
  [[noreturn]] void refuse(const std::string& key, const std::string& what) const;

 private:
  /// Reads `count` values of a dataset as `memory`. Throws Error as numbers() does.
  void read(const std::string& key, hid_t memory, std::size_t count, void* values) const;
  void check_is_inside(hid_t data, const std::string& key) const;
  std::string path_;
  Hdf5Id file_;
};

class Hdf5Writer {
 public:
  Hdf5Writer();
  void group(const std::string& key);
  void attribute(const std::string& key, const std::string& name, const std::string& value);
  void text(const std::string& key, const std::string& value);
  void whole_number(const std::string& key, unsigned long value);
  void number(const std::string& key, double value);
  void matrix(const std::string& key, const std::vector<double>& values, std::size_t rows, std::size_t columns);
  /// The file so far.
  std::string bytes() const;

 private:
  void dataset(const std::string& key, hid_t type, hid_t space, const void* values);
  Hdf5Id file_;
};

}  // namespace marrow::exchange
