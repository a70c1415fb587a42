// SPDX-License-Identifier: Apache-2.0
#pragma once
// The store of a host keeps the digests of large files. So a whole CT is not read by every process.
#include <filesystem>
#include <functional>

#include "marrow/base/export.hpp"
#include "marrow/base/file_state.hpp"

namespace MARROW_EXPORT marrow {

/// From now on, this process finds digests of large files in the store of this folder, and keeps them there.
void keep_digests_in(const std::filesystem::path& store);

/// The digest of a large file in this state, which must be settled (is_settled()). If it is not kept, calls make(),
/// while other processes of this host wait for it. It is kept if the file still has the state afterwards. Small files
/// are not kept. A damaged record counts as absent.
Digest digest_in_state(const std::filesystem::path& file, const FileState& state, const std::function<Digest()>& make);

}  // namespace marrow
