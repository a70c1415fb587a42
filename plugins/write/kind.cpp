// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that give a value as a file in another program's format. These nodes choose their ports freely. The
// other libraries of this folder write the outputs of a run in marrow's own formats.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("write").summary("gives values as files in the formats of other programs"); }
