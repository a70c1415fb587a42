// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow {

/// The members of a value type, in the order in which they are hashed and stored:
///
///   struct Edge { double u_px = 0, v_px = 0; using fields = Fields<&Edge::u_px, &Edge::v_px>; };
template <auto... Members>
struct Fields {};

}  // namespace marrow
