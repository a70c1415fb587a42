// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <optional>
#include <span>

#include "marrow/runtime/plugins/library.hpp"
#include "marrow/runtime/plugins/trust.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// A file or folder that a description depends on.
struct IndexedFile {
  std::string path;
  Digest state;  ///< of its FileState; 0 if it does not exist
  using fields = Fields<&IndexedFile::path, &IndexedFile::state>;
};

struct IndexedLibrary {
  LibraryInfo info;
  std::vector<IndexedFile> files;
  std::vector<std::string> folders;                  ///< as in TrustedFiles
  std::vector<std::array<std::uint32_t, 2>> groups;  ///< as in TrustedFiles
  using fields =
      Fields<&IndexedLibrary::info, &IndexedLibrary::files, &IndexedLibrary::folders, &IndexedLibrary::groups>;
};

/// The descriptions of the libraries of one folder, in one file of the user's cache: what library_info() returned at an
/// earlier start. A later start only checks whether the sources of a description have changed. It compares
/// size, inode and times of the library, its manifest, the libraries that it links and the folders that were searched,
/// and the owners and modes of the folders above. If anything has changed, the library is not found here. A file of the
/// cache that is damaged, or that another build wrote, is ignored.
class LibraryIndex {
 public:
  explicit LibraryIndex(const std::filesystem::path& folder);

  /// The description of a library; nothing if it is not known or may have changed.
  std::optional<LibraryInfo> find(const std::filesystem::path& library);
  /// Writes the descriptions of all libraries of the folder, if there are new ones that can be kept. It keeps
  /// no refused libraries, none in Python, and none with a file that changed so recently that its next change might not
  /// show.
  void keep(std::span<const LibraryInfo> all);
  /// Removes the file of a folder.
  static void forget(const std::filesystem::path& folder);

 private:
  bool is_current(const IndexedLibrary& library);
  Digest state_of_file(const std::string& path);
  std::optional<IndexedLibrary> indexed(const LibraryInfo& info) const;

  std::string name_;
  std::map<std::string, IndexedLibrary> libraries_;  ///< by their paths
  std::map<std::string, Digest> states_;             ///< as they are now
  std::map<std::string, bool> is_trusted_;
  std::int64_t begun_s_;
};

}  // namespace marrow
