// SPDX-License-Identifier: Apache-2.0
#pragma once
// The folder of a shared store: who may use it, and how its files are read although hosts see each other's files late.
//   marrow-store   says that this is a shared store
//   01/01...HEX    entries: results, and simulated cases as one file each
//   claims/HEX     who makes a result
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "marrow/runtime/store/store_file.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

struct SharedFolderState {
  bool is_store = false;
  bool may_write = false;
  std::string fault;  ///< why it cannot be used
  Permissions permissions;
};
/// A shared store may belong to another user. The folder must exist; so a mount point without its mount is not taken
/// for it. Its files have the group's rights of the folder. Nobody else may read or write them.
SharedFolderState examine_shared(const std::filesystem::path& folder);
/// Turns an empty folder into a store. Returns what examine_shared() then says.
SharedFolderState make_shared(const std::filesystem::path& folder);

/// Whether the file's name is in its folder. Listing asks the server again. The folder itself may be new to this host.
bool is_listed(const std::filesystem::path& file);

/// `quick` relies on what this host remembers about a folder. `listed` lists the folder first, to learn of new files.
enum class SharedLook { quick, listed };

/// Opens a file and calls use(file). If it returns false, because the file cannot be read or is not whole, or if a file
/// that is listed cannot be opened, tries again with pauses, about a second in all. Returns whether use() returned
/// true. `fault` is set if the folder cannot be read at all.
bool read_shared(const std::filesystem::path& file, SharedLook look, const std::function<bool(const StoreFile&)>& use,
                 std::string& fault);

// Claims on results between hosts. Locks are not used, because many shared folders refuse them or keep them to one
// host. A claim is a file that one process alone can make (O_EXCL). Its owner raises a number in it from time to time.
// Others wait while they see the number change. A lost claim costs double work, but never gives a wrong result.

class HeldClaim;

/// The right to make one result, among all hosts. The destructor gives it back.
class SharedClaim {
 public:
  SharedClaim() = default;  ///< holds nothing
  explicit SharedClaim(std::shared_ptr<HeldClaim> held);
  SharedClaim(SharedClaim&&) noexcept = default;
  SharedClaim& operator=(SharedClaim&&) = delete;
  ~SharedClaim();
  bool is_held() const { return held_ != nullptr; }

 private:
  std::shared_ptr<HeldClaim> held_;
};

/// Seconds without a sign of life after which others take a claim of this process over: MARROW_CLAIM_SECONDS, or 30.
double claim_seconds();

/// Waits for the claim of a file, as Store::claim() does. Takes it over if its owner has ended, or if nothing changed
/// for the seconds that the owner promised, by the clock of this process alone. Returns an empty claim if `cancelled`
/// becomes true, or if the file cannot be made: `fault` then says why.
SharedClaim claim_file(const std::filesystem::path& file, const Permissions& permissions,
                       const std::atomic<bool>* cancelled, const std::function<void(bool waits)>& on_wait,
                       std::string& fault);

/// The identity of the process that owns a claim; empty if the file does not say.
std::string owner_of_claim(const std::filesystem::path& file);

}  // namespace marrow
