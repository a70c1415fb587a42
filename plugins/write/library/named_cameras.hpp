// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/error.hpp"
#include "marrow/toolbox/exchange/cameras.hpp"

namespace marrow::write {

/// The cameras of a node that takes either cameras or views. Throws Error if it got neither, or if check_camera()
/// refuses one of them.
inline List<Camera> named_cameras(const List<Camera>* cameras, const List<View>* views) {
  List<Camera> named;
  if (cameras) named = *cameras;
  if (views)
    for (std::size_t i = 0; i < views->size(); ++i) named.add(views->name(i), (*views)[i].camera);
  if (named.empty()) throw Error("the node that is wired to 'cameras' or 'views' gave none");
  for (std::size_t i = 0; i < named.size(); ++i) check_camera(named[i], "the camera of '" + named.name(i) + "'");
  return named;
}

}  // namespace marrow::write
