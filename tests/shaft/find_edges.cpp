// SPDX-License-Identifier: Apache-2.0
// A program can hold the entry of one plugin only: this one's gets another name.
#include "shaft/find_edges.hpp"

#include "plugins/edges/adaptive_relaxation.cpp"

marrow::EdgeMap find_edges(const marrow::View& view) { return adaptive_relaxation(view, Options{}); }
