// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that read files. These nodes choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("read")
      .summary("reads values from files")
      .runs_apart(marrow::Apart::parses)
      .trait("names_files",
             "the file of its option 'path' names further ones in its folder or below: all of these count in the "
             "key, and 'marrow check' calls the node to say which are missing");
}
