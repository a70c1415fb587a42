// SPDX-License-Identifier: Apache-2.0
#pragma once
// The nodes that a registration is put together from, as plain functions with their default options.
#include <marrow/domain/case.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/functions.hpp>

std::shared_ptr<const marrow::OutlineProjector> outline_node(const marrow::Mesh& mesh,
                                                             const marrow::Volume* volume = nullptr);
std::shared_ptr<const marrow::Cost> cost_node(const marrow::OutlineProjector& projector,
                                              const marrow::List<marrow::View>& views,
                                              const marrow::List<marrow::EdgeMap>& edges);
std::shared_ptr<const marrow::Optimizer> optimizer_node();
