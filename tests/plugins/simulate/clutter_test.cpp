// SPDX-License-Identifier: Apache-2.0
// Bodies in the beam and in the CT, and the node that adds them.

#include "marrow/simulate/knee.hpp"
#include "marrow/simulate/solid.hpp"
#include "marrow/simulate/surgery.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::clutter_test {

using namespace simulated;

/// A small bone far from the middle of the image, without soft tissue.
Phantom nothing() { return whole(box_between({-2, -2, -80}, {2, 2, -76})); }

Inputs in_beam(const ClutteredPhantom& phantom, int size_px = 129) {
  return {{"phantom", item(phantom)}, {"cameras", per_view("frontal", camera(0, size_px))}};
}
View exposed(const ClutteredPhantom& phantom, int size_px = 129, double photons = 0, std::uint64_t seed = 1) {
  return output_list<View>("simulate.cluttered_fluoroscopy", "views", in_beam(phantom, size_px),
                           {{"photons", photons}, {"blur_px", 0.0}, {"scatter_to_primary", 0.0}}, Context(seed))[0];
}
Volume scanned(const ClutteredPhantom& phantom, const Options& options, std::uint64_t seed = 0) {
  return output<Volume>("simulate.cluttered_ct", "volume", {{"phantom", item(phantom)}}, options, Context(seed));
}

Options all_at(const std::string& level) {
  Options options;
  for (const char* name : {"knee", "fat", "folds", "vessels", "pin", "plate", "cable", "clamp", "table", "lag"})
    options[name] = level;
  return options;
}

const Phantom& broken() {
  static const Phantom made = fracture(femur({{"resolution_mm", 2.0}}), {{"rotation_deg", Numbers{3, -4, 8}}});
  return made;
}
const ClutteredPhantom& usual() {
  static const ClutteredPhantom made = cluttered(broken(), all_at("usual"));
  return made;
}
/// All bodies in the beam.
std::vector<Body> all_bodies(const ClutteredPhantom& phantom) {
  std::vector<Body> all = phantom.tissues;
  all.insert(all.end(), phantom.bodies.begin(), phantom.bodies.end());
  return all;
}

TEST(SimulateClutter, MetalWeakensTheBeamByBeersLaw) {
  // 2 mm of steel: 0.40 exp(-5.734) + 0.33 exp(-3.094) + 0.20 exp(-1.904) + 0.07 exp(-1.304) = 0.06502. The rays of
  // the middle pixel lie 0.15 mm beside the axis at most, where the chord is 1 % shorter.
  const ClutteredPhantom rod{nothing(), {}, {body("steel", phantom::tube({0, 0, -40}, {0, 0, 40}, 1, 720))}};
  EXPECT_NEAR(grey(exposed(rod, 513), 256, 256) / 12000.0, 0.06502, 0.0012);
  // 4.5 mm of titanium along the beam: 0.40 exp(-4.4933) + 0.33 exp(-2.4620) + 0.20 exp(-1.5548) + 0.07 exp(-1.1052)
  // = 0.004474 + 0.028136 + 0.042246 + 0.023181.
  const Mesh plate = phantom::bar({{0, 0, -40}, {0, 0, 40}}, Vector3d::UnitY(), 14, 4.5);
  EXPECT_NEAR(enclosed_volume_mm3(plate), 14 * 4.5 * 80, 1e-6);
  EXPECT_NEAR(grey(exposed({nothing(), {}, {body("titanium", plate)}}), 64, 64) / 12000.0, 0.098037, 0.0003);
}

TEST(SimulateClutter, APinCastsAShadowOfItsDiameter) {
  // 4 mm at the isocentre, 600 of 1000 mm from the source, with pixels of 0.586 mm: 4 / 0.6 / 0.586 = 11.38 px. At the
  // rim, 0.58 mm of steel halve the beam: the chord of the circle 0.042 mm inside its border, 0.12 px on each side.
  const View view = exposed({nothing(), {}, {body("steel", phantom::tube({-60, 0, 0}, {60, 0, 0}, 2, 720))}}, 512);
  int dark = 0;
  for (int v = 200; v < 312; ++v) dark += grey(view, 256, v) < 6000;
  EXPECT_NEAR(dark, 11.38 - 0.24, 1.2) << "the pin lies between two pixels, so the count is even";
}

TEST(SimulateClutter, ALaterBodyReplacesWhatItOverlaps) {
  std::vector<std::array<double, 3>> parts;
  phantom::visit_layers({{0, 10, 1}, {2, 5, 3}, {4, 7, 2}, {12, 14, 1}},
                        [&](const phantom::Layer& layer, double from, double to) {
                          parts.push_back({from, to, double(layer.rank)});
                        });
  EXPECT_EQ(parts,
            (std::vector<std::array<double, 3>>{{0, 2, 1}, {2, 4, 3}, {4, 5, 3}, {5, 7, 2}, {7, 10, 1}, {12, 14, 1}}));
  // A hollow of plastic in steel in bone in muscle: each replaces a length of what surrounds it.
  const ClutteredPhantom phantom{whole(box_between({-30, -20, -30}, {30, 20, 30}), {}, 80, 10),
                                 {},
                                 {body("steel", box_between({-30, -1, -30}, {30, 1, 30})),
                                  body("plastic", box_between({-30, -0.5, -30}, {30, 0.5, 30}))}};
  const phantom::Spectrum steel = phantom::material("steel").per_mm, plastic = phantom::material("plastic").per_mm;
  const std::array<double, 4> share{0.40, 0.33, 0.20, 0.07};
  double expected = 0, tissue = 0;
  for (std::size_t e = 0; e < 4; ++e) {
    const double soft = 140 * phantom::kMusclePerMm[e] + 20 * phantom::kFatPerMm[e];
    tissue += share[e] * std::exp(-soft);
    expected += share[e] *
                std::exp(-(soft - 40 * phantom::kMusclePerMm[e] + 38 * phantom::kBonePerMm[e] + steel[e] + plastic[e]));
  }
  EXPECT_NEAR(grey(exposed(phantom), 64, 64), 12000 * expected / tissue, 1);
}

TEST(SimulateClutter, UnevenFatIsMovedNotAdded) {
  const Bone& bone = broken().bone;
  marrow::Random first(5), second(5);
  const auto even = phantom::make_thigh(bone, {}, first),
             uneven = phantom::make_thigh(bone, {.unevenness = 0.8}, second);
  ASSERT_EQ(even.size(), 2u);
  EXPECT_NEAR(enclosed_volume_mm3(uneven[1].surface) / enclosed_volume_mm3(even[1].surface), 1, 1e-3);
  EXPECT_EQ(even[0].surface.vertices_mm, uneven[0].surface.vertices_mm);
  double least = 1e9, most = 0;
  for (const auto& vertex : uneven[1].surface.vertices_mm) {
    const double fat = bone.thigh_radius_mm - (vertex.head<2>() - bone.thigh_centre_mm).norm();
    if (fat > 60) continue;  // the middle of an end
    least = std::min(least, fat);
    most = std::max(most, fat);
  }
  EXPECT_GT(least, 12 * 0.2 - 1);
  EXPECT_LT(least, 7);
  EXPECT_GT(most, 17);
  EXPECT_LT(most, 12 * 1.8 + 0.8);  // 9.6^2 / (2 x 68) more, because areas are kept
  // Without unevenness the surfaces are the cylinders of the bone, up to the corners of their 240 sides.
  const View round = exposed({broken(), {}, {}}), sides = exposed({broken(), even, {}});
  EXPECT_NEAR(grey(sides, 64, 5) / double(grey(round, 64, 5)), 1, 2e-3);
}

TEST(SimulateClutter, NothingChangesWhenAllIsOff) {
  const Outputs made = call("simulate.clutter", {{"phantom", item(broken())}});
  EXPECT_EQ(made.count("earlier"), 1u);
  const auto& same = made.at("phantom").as<ClutteredPhantom>();
  EXPECT_TRUE(same.tissues.empty() && same.bodies.empty());
  const Options options{{"noise_hu", 0.0}, {"range_mm", Numbers{20, 40}}};
  EXPECT_EQ(scanned(same, options).values, ct(broken(), options).values);
}

TEST(SimulateClutter, EachLevelAddsItsBodies) {
  for (const char* level : {"mild", "usual", "bad"}) {
    const ClutteredPhantom phantom = cluttered(broken(), all_at(level));
    phantom::check_phantom(phantom, level);  // closed, oriented, of known materials
    std::map<std::string, int> count;
    for (const Body& one : all_bodies(phantom)) ++count[one.name];
    for (const char* name : {"skin", "muscle", "artery", "tibia", "tibia, inside", "fibula", "patella", "plate",
                             "screw", "clamp", "rod", "table's edge", "pin", "cable", "vein"})
      EXPECT_GE(count[name], 1) << name << " " << level;
    EXPECT_EQ(count["pin"], level == std::string("bad") ? 2 : 1);
    EXPECT_EQ(count["table's rail"], level == std::string("bad") ? 1 : 0);
  }
}

TEST(SimulateClutter, WhatIsFixedToTheFragmentMovesWithIt) {
  const Fragment& distal = usual().phantom.fragments[1];
  for (const Body& one : usual().bodies) {
    const bool is_fixed = one.name == "plate" || one.name == "screw" || one.name == "pin" ||
                          one.name.starts_with("tibia") || one.name.starts_with("fibula") ||
                          one.name.starts_with("patella");
    EXPECT_EQ(one.moves_with, is_fixed ? "distal" : "") << one.name;
    if (one.name != "plate" && one.name != "screw") continue;
    EXPECT_TRUE(one.in_ct);
    const RigidTransform still = distal.world_from_ct * one.ct_from_world;
    EXPECT_NEAR((still.rotation - Matrix3d::Identity()).norm() + still.translation_mm.norm(), 0, 1e-9);
  }
}

TEST(SimulateClutter, TheKneeHasTheFemursSizeAndNeitherTouchesIt) {
  const ClutteredPhantom phantom = cluttered(broken(), {{"knee", "usual"}});
  const phantom::DistalEnd end = phantom::distal_end(broken().bone.outer);
  EXPECT_NEAR(end.lateral_x, 1, 0);  // a left femur: its head points to the patient's right
  const RigidTransform bone_from_world = inverse(phantom.phantom.fragments[1].world_from_bone());
  for (const Body& one : phantom.bodies) {
    Eigen::AlignedBox3d box;
    for (const auto& vertex : one.surface.vertices_mm) box.extend(bone_from_world * vertex);
    if (one.name == "tibia") {
      EXPECT_NEAR(box.sizes().x(), 2 * 37 * end.half_width_mm / 41, 3);
      EXPECT_LT(box.max().z(), end.lowest_z + 12);  // only the eminence reaches between the condyles
    }
    if (one.name == "patella") {
      EXPECT_NEAR(box.sizes().x(), 44 * end.half_width_mm / 41, 3);
      EXPECT_LT(box.center().y(), end.front_y);
    }
    if (one.name == "fibula") {
      EXPECT_GT(box.center().x(), end.middle_mm.x() + 25);
    }
  }
}

TEST(SimulateClutter, PlacesDependOnTheSeedAlone) {
  const auto made = [&](int seed, std::size_t threads) {
    return with_threads(threads, [&] {
      std::vector<Vector3d> vertices;
      for (const Body& one : all_bodies(cluttered(broken(), with(all_at("usual"), {{"clutter_seed", seed}}))))
        vertices.insert(vertices.end(), one.surface.vertices_mm.begin(), one.surface.vertices_mm.end());
      return vertices;
    });
  };
  const auto one = made(3, 1);
  EXPECT_EQ(one, made(3, 2));
  EXPECT_NE(one, made(4, 2));
  // A level does not move what another one adds.
  const auto plate = [](const ClutteredPhantom& phantom) {
    for (const Body& one : phantom.bodies)
      if (one.name == "plate") return one.surface.vertices_mm;
    return std::vector<Vector3d>();
  };
  EXPECT_EQ(plate(cluttered(broken(), {{"plate", "usual"}})), plate(usual()));
}

TEST(SimulateClutter, ImagesAndCtAreTheSameAtAnyNumberOfThreads) {
  const auto image = [](std::size_t threads) {
    return with_threads(threads, [] { return exposed(usual(), 96, 2000, 7); });
  };
  EXPECT_TRUE(same(image(1), image(2)));
  const auto values = [](std::size_t threads) {
    return with_threads(threads, [] {
      return scanned(usual(), {{"spacing_mm", Numbers{1.6, 1.6, 4}}, {"range_mm", Numbers{0, 80}}}, 7).values;
    });
  };
  EXPECT_EQ(values(1), values(2));
}

TEST(SimulateClutter, TheEarlierFrameShowsTheFragmentElsewhere) {
  const auto before =
      output<ClutteredPhantom>("simulate.clutter", "earlier", {{"phantom", item(broken())}}, all_at("usual"));
  const ClutteredPhantom& now = usual();
  const Vector3d shift =
      before.phantom.fragments[1].world_from_ct.translation_mm - now.phantom.fragments[1].world_from_ct.translation_mm;
  EXPECT_NEAR(shift.norm(), 3, 1e-9);
  EXPECT_EQ(before.phantom.fragments[0].world_from_ct.translation_mm,
            now.phantom.fragments[0].world_from_ct.translation_mm);
  for (std::size_t i = 0; i < now.bodies.size(); ++i) {
    const Vector3d moved = before.bodies[i].surface.vertices_mm[0] - now.bodies[i].surface.vertices_mm[0];
    EXPECT_NEAR((moved - (now.bodies[i].moves_with.empty() ? Vector3d::Zero().eval() : shift)).norm(), 0, 1e-9);
  }
}

TEST(SimulateClutter, TheCtShowsWhatIsInThePatient) {
  const Phantom bone = whole(box_between({-15, -15, 0}, {15, 15, 60}), {}, 30, 6);
  Body tissue = body("fat", phantom::tube({0, 0, -100}, {0, 0, 200}, 30, 240));
  Body muscle = body("muscle", phantom::tube({0, 0, -100}, {0, 0, 200}, 20, 240));
  Body marker = body("plastic", box_between({0, 0, 0}, {8, 8, 8})), outside = marker;
  tissue.in_ct = muscle.in_ct = marker.in_ct = true;
  marker.ct_from_world.translation_mm = {0, 0, 30};
  outside.surface = box_between({-10, -10, 10}, {-2, -2, 18});
  const Volume volume = scanned({bone, {tissue, muscle}, {marker, outside}}, {{"noise_hu", 0.0}, {"margin_mm", 16.0}});
  EXPECT_NEAR(value_at(volume, {4, 4, 34}), 120, 2);  // where it lies in the CT, not in the images
  EXPECT_NEAR(value_at(volume, {4, 4, 4}), 1450, 1);
  EXPECT_NEAR(value_at(volume, {-6, -6, 14}), 1450, 1);  // the CT does not show what is not in the patient
  EXPECT_NEAR(value_at(volume, {17.5, 0, 30}), 50, 2);
  EXPECT_NEAR(value_at(volume, {25, 0, 30}), -100, 2);
  EXPECT_NEAR(value_at(volume, {27, 27, 30}), -1000, 2);
}

TEST(SimulateClutter, SlicesAverageOverTheirThickness) {
  // A face at z = 0 between bone and air. Over a slice of 2 mm without blur, the value 0.4 mm outside is
  // (1 - 0.4) / 2 = 30 % bone, to the raster of 0.29 mm.
  const Volume volume =
      scanned({whole(box_between({-10, -10, 0}, {10, 10, 40})), {}, {}}, {{"noise_hu", 0.0},
                                                                          {"blur_mm", 0.0},
                                                                          {"margin_mm", 10.4},
                                                                          {"spacing_mm", Numbers{1, 1, 2}},
                                                                          {"slice_thickness_mm", 2.0}});
  ASSERT_NEAR(volume.grid.index_from_point({0, 0, -0.4}).z(), 5, 1e-9);
  EXPECT_NEAR((volume.at(20, 20, 5) + 1000) / 2450, 0.3, 0.08);
  EXPECT_EQ(volume.at(20, 20, 3), -1000);
  EXPECT_EQ(volume.at(20, 20, 7), 1450);
}

TEST(SimulateClutter, MetalMakesStreaksBetweenItsPartsOnly) {
  ClutteredPhantom rods{whole(box_between({-2, -2, -20}, {2, 2, 20}), {}, 80, 12), {}, {}};
  for (const double x : {-20.0, 20.0}) {
    rods.bodies.push_back(body("steel", phantom::tube({x, 0, -8}, {x, 0, 8}, 3)));
    rods.bodies.back().in_ct = true;
  }
  const auto scan = [&](double streaks) {
    return scanned(rods, {{"noise_hu", 0.0}, {"margin_mm", 30.0}, {"metal_streaks", streaks}}, 3);
  };
  const Volume without = scan(0), streaked = scan(1);
  EXPECT_EQ(value_at(without, {20, 0, 0}), 3071);
  EXPECT_EQ(value_at(streaked, {20, 0, 0}), 3071);
  EXPECT_NEAR(value_at(without, {10, 0, 0}), 50, 1);
  EXPECT_LT(value_at(streaked, {10, 0, 0}), -50);        // dark between the rods
  EXPECT_NEAR(value_at(streaked, {0, 25, 0}), 50, 150);  // little beside them
  EXPECT_EQ(value_at(streaked, {10, 0, 18}), value_at(without, {10, 0, 18})) << "slices without metal stay as they are";
  EXPECT_EQ(streaked.values, scan(1).values);
}

TEST(SimulateClutter, BadInputIsExplained) {
  Phantom thin = broken();
  thin.bone.thigh_radius_mm = 0;
  EXPECT_EQ(refusal("simulate.clutter", {{"phantom", item(thin)}}, {{"fat", "mild"}}),
            "simulate.clutter: fat, folds and vessels need soft tissue, but the bone has none; set thigh_radius_mm of "
            "the bone, or these three to 'off'");
  const auto refused = [](const Body& thing) {
    return refusal("simulate.cluttered_fluoroscopy", in_beam({nothing(), {}, {thing}}));
  };
  const Mesh cube = box_between({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(refused(body("cheese", cube)),
            "simulate.fluoroscopy, 'thing': there is no material 'cheese'; there are: fat, muscle, blood, cortical "
            "bone, cancellous bone, calcified wall, titanium, steel, copper, plastic, carbon");
  EXPECT_EQ(refused(body("steel", box_between({-1, -610, -1}, {1, 0, 1}))),
            "simulate.fluoroscopy: 'thing' reaches to -10.000000 mm from the X-ray source; it must lie in front of the "
            "source, so check the camera's distances and where it is placed");
  EXPECT_EQ(refused(body("fat", opened(cube))),
            "simulate.fluoroscopy, 'thing': the surface is open or not consistently oriented, so it has no inside; "
            "close its holes (each edge must be shared by exactly two triangles)");
}

TEST(SimulateClutter, APlateWithoutRoomIsLeftOutWithAWarning) {
  Heard heard;
  const Phantom low = fracture(femur({{"resolution_mm", 2.0}}), {{"height_fraction", 0.12}, {"obliquity_deg", 0.0}});
  const auto made = output<ClutteredPhantom>("simulate.clutter", "phantom", {{"phantom", item(low)}},
                                             {{"plate", "bad"}}, heard.context);
  EXPECT_TRUE(made.bodies.empty());
  EXPECT_EQ(heard.lines, Strings{"the fracture is too near to the knee for a plate below it; it is left out"});
}

}  // namespace marrow::test::clutter_test
