// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/fields.hpp"
#include "marrow/domain/case.hpp"
#include "marrow/domain/mesh.hpp"
#include "marrow/runtime/node/value.hpp"

namespace marrow::phantom {

/// A case as it is to be written, with the way in which it gives its fragments. `labels` and `surfaces` are empty for
/// seeds.
struct CaseFolder {
  Case parts;
  Volume labels;        ///< 1 in the first fragment of Case::seeds, 2 in the second and so on; 0 outside
  List<Mesh> surfaces;  ///< of each fragment of Case::seeds; then there is no CT
  using fields = Fields<&CaseFolder::parts, &CaseFolder::labels, &CaseFolder::surfaces>;
};

}  // namespace marrow::phantom

MARROW_VALUE_TYPE(marrow::phantom::CaseFolder, "case_folder", 1)
