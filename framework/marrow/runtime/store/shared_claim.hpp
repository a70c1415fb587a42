// SPDX-License-Identifier: Apache-2.0
#pragma once
// Claims on results between hosts. Locks are not used, because many shared folders refuse them or keep them to one
// host. A claim is a file that one process alone can make (O_EXCL). Its owner raises a number in it from time to time.
// Others wait while they see the number change. A lost claim costs double work, but never gives a wrong result.
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/runtime/store/store_file.hpp"

namespace MARROW_EXPORT marrow {

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
