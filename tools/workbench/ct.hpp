// SPDX-License-Identifier: Apache-2.0
#pragma once
// The parts of the page "Case" that work on its CT share the CTs in memory.
#include <cstdint>
#include <list>

#include "marrow/domain/volume.hpp"
#include "workbench/workbench.hpp"

namespace marrow::workbench {

// The open CTs. They stay in memory, so each slice is there at once and all tabs share one copy.

struct OpenCt {
  std::string name;  ///< unique while the server runs
  Value value;       ///< of type volume
  float lowest_hu = 0, highest_hu = 0;

  const Volume& volume() const { return value.as<Volume>(); }
  std::uintmax_t bytes() const { return volume().values.size() * sizeof(float); }
};

/// The memory that all open CTs may take: 3 GB, or half of the machine's memory if that is less.
std::uintmax_t most_ct_bytes();

/// All methods may be called from several threads.
class CtMemory {
 public:
  explicit CtMemory(std::uintmax_t most_bytes = most_ct_bytes()) : most_bytes_(most_bytes) {}

  /// `content` names the files and options from which it was read. nullptr if it is not in memory.
  std::shared_ptr<const OpenCt> by_content(const std::string& content);
  /// Throws Conflict if it is no longer in memory: the page then opens it again.
  std::shared_ptr<const OpenCt> by_name(const std::string& name);
  /// Keeps a CT, and forgets those that were not used for the longest time. Throws Error if it alone is too large.
  std::shared_ptr<const OpenCt> add(const std::string& content, Value value);
  /// Says that the files of `same` hold what those of `content` hold, because they were copied.
  void add_copy(const std::string& content, const std::string& same);
  /// Hold this while a CT is read, so that two tabs do not read it twice.
  std::timed_mutex& reading() { return reading_; }
  /// Throws Error if files of this size hold a volume that is too large.
  void check_size(std::uintmax_t file_bytes) const;

 private:
  struct Entry {
    std::vector<std::string> contents;
    std::shared_ptr<const OpenCt> ct;
  };
  std::list<Entry>::iterator find(const std::string& content);
  std::shared_ptr<const OpenCt> used(std::list<Entry>::iterator entry);

  const std::uintmax_t most_bytes_;
  std::mutex mutex_;
  std::timed_mutex reading_;
  std::list<Entry> open_;  ///< the last used one comes first
  int count_ = 0;
};

/// {name, size, spacing_mm, origin_mm, direction: rows, lowest_hu, highest_hu, doubts}
nlohmann::json about_ct(const OpenCt& ct);

/// The samples of one slice perpendicular to an axis of the grid, as int16 in HU. The lower one of the other two axes
/// runs fastest. Values are rounded and clamped to int16.
std::string slice_of(const Volume& volume, int axis, int index);

/// Size and time of change of a CT's file, or of all files of its folder. While these stay, the content does, too.
struct FilesOfCt {
  std::uintmax_t bytes = 0;
  std::string description;

  /// Throws Error if there is no such file or folder, or the folder holds too many files.
  explicit FilesOfCt(const std::filesystem::path& place);

 private:
  void add(const std::filesystem::path& file);
};

/// The `content` of a CT for CtMemory: its place, its files, and the options of a case's `ct`.
std::string content_of_ct(const std::filesystem::path& place, nlohmann::json ct, const FilesOfCt& files);

/// POST /api/labels/open, GET /api/labels/slice
void add_label_reading(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);
/// POST /api/segment, GET /api/segmentation/outlines, GET /api/segmentation/surface
void add_segmenting(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);
/// POST /api/case/save
void add_saving(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);

}  // namespace marrow::workbench
