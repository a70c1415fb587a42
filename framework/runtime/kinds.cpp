// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/kinds.hpp"

namespace marrow {

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> kKinds = {
      {"read", "value from a file", {}, {}, true, false, Kind::Apart::parses},
      {"simulate", "data with exact truth", {}, {}, true, false, Kind::Apart::computes},
      {"camera", "geometry of a view", {}, {}, true, false, Kind::Apart::computes},
      {"edges", "edge pixels of an X-ray view", {{"view", "view", ""}}, {{"edges", "edge_map", ""}}},
      {"shaft",
       "outer borders of the bone's shaft in a view",
       {{"edges", "edge_map", ""}, {"view", "view", ""}},
       {{"lines", "shaft_lines", ""}}},
      {"segment",
       "signed distance field per fragment, negative inside",
       {{"volume", "volume", ""}, {"seeds", "seeds", "fragment"}, {"template", "mesh", ""}},
       {{"field", "signed_field", "fragment"}}},
      {"mesh",
       "closed surface: of a signed field, or made from another one",
       {{"field", "signed_field", ""}, {"mesh", "mesh", ""}},
       {{"mesh", "mesh", ""}}},
      {"project",
       "draws a model as a view would see it: outline or radiograph",
       {{"mesh", "mesh", ""}, {"volume", "volume", ""}, {"field", "signed_field", ""}, {"views", "view", "view"}},
       {{"projector", "projector", ""}}},
      {"similarity",
       "how badly a pose explains the images",
       {{"projector", "projector", ""},
        {"mesh", "mesh", ""},
        {"volume", "volume", ""},
        {"field", "signed_field", ""},
        {"views", "view", "view"},
        {"edges", "edge_map", "view"},
        {"others", "pose", "fragment"},
        {"other_projectors", "projector", "fragment"}},
       {{"cost", "cost", ""}}},
      {"optimizer", "minimises a function of n numbers", {}, {{"optimizer", "optimizer", ""}}},
      {"initial",
       "pose to start from",
       {{"model", "mesh", ""},
        {"lines", "shaft_lines", "view"},
        {"views", "view", "view"},
        {"start", "pose", ""},
        {"landmarks", "landmarks", ""},
        {"cost", "cost", ""},
        {"optimizer", "optimizer", ""}},
       {{"pose", "pose", ""}}},
      {"register",
       "pose of least cost, with its predicted uncertainty",
       {{"cost", "cost", ""},
        {"finer_cost", "cost", ""},
        {"optimizer", "optimizer", ""},
        {"finer_optimizer", "optimizer", ""},
        {"initial", "pose", ""},
        {"model", "mesh", ""},
        {"target", "mesh", ""}},
       {{"pose", "pose", ""}, {"stages", "pose", "stage"}}},
      {"fracture", "misalignment and reduction from the poses of two fragments", {}, {}, true, false},
      {"evaluate", "figures of merit of a result", {}, {}, true, true},
      {"render", "pictures for people", {}, {}, true, true},
  };
  return kKinds;
}

const Kind* find_kind(std::string_view name) {
  for (const Kind& kind : kinds())
    if (kind.name == name) return &kind;
  return nullptr;
}

}  // namespace marrow
