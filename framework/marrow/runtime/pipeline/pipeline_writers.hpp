// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

std::string no_writer(const TypeInfo& type);

}  // namespace marrow
