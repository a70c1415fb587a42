// SPDX-License-Identifier: Apache-2.0
#pragma once
// Copies of what has values of options, for when memory lacks. The std::variant of libstdc++ 12, when a text or list that
// is copied into a new variant gets no memory, destroys what it has not made (its storage counts as never without a
// value), and the program crashes. An assignment makes the copy of the text first.
#include "marrow/runtime/node.hpp"

namespace marrow {

inline OptionValue copy_of(const OptionValue& value) {
  OptionValue copy;
  copy = value;
  return copy;
}

inline NodeInfo copy_of(const NodeInfo& info) {
  NodeInfo copy{info.name, info.summary, info.inputs, info.outputs, std::vector<OptionInfo>(info.options.size()),
                info.random};
  for (std::size_t i = 0; i < info.options.size(); ++i) copy.options[i] = info.options[i];
  return copy;
}

}  // namespace marrow
