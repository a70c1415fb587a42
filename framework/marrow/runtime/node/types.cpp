// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/node/types.hpp"

namespace marrow {

#define MARROW_COMPILED_HERE(Type, id, version) template const Content* content_of<Type>();
MARROW_OWN_TYPES(MARROW_COMPILED_HERE)
#undef MARROW_COMPILED_HERE

}  // namespace marrow
