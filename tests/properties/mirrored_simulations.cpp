// SPDX-License-Identifier: Apache-2.0
// The nodes that simulate: of a mirrored bone, moved in the mirrored way.

#include "marrow/simulate/posture.hpp"
#include "tests/properties/mirrored_values.hpp"

namespace mirrored_patient {
namespace {

using namespace marrow;
using phantom::Posture;
using shipped::Options, shipped::output, shipped::output_list;

void femur() {
  const Bone& left = left_femur();
  const Bone right =
      output<Bone>("simulate.femur", "bone", {}, {{"resolution_mm", 2.0}, {"side", std::string("right")}});
  // The triangles are others, as the cubes are not mirrored.
  const auto compare = [](const Mesh& found, const Mesh& of) {
    EXPECT_NEAR(enclosed_volume_mm3(found) / enclosed_volume_mm3(of), 1, 1e-3);
    const FragmentFrame frame = fragment_frame(found), expected = mirrored(fragment_frame(of));
    EXPECT_LT((frame.origin_mm - expected.origin_mm).norm(), 0.05);
    EXPECT_LT((frame.axes - expected.axes).norm(), 1e-3);
  };
  compare(right.outer, left.outer);
  compare(right.inner, left.inner);
}

void expect_mirrored_phantom(const Phantom& found, const Phantom& of) {
  ASSERT_EQ(found.fragments.size(), of.fragments.size());
  for (std::size_t i = 0; i < of.fragments.size(); ++i) {
    const Fragment &one = found.fragments[i], expected = mirrored(of.fragments[i]);
    EXPECT_EQ(one.name, expected.name);
    EXPECT_LT((one.frame.axes - expected.frame.axes).norm(), 1e-9) << one.name;
    EXPECT_LT((one.frame.origin_mm - expected.frame.origin_mm).norm(), 1e-6) << one.name;
    expect_mirrored(one.world_from_ct, of.fragments[i].world_from_ct, 1e-6, one.name);
    expect_mirrored(one.ct_from_bone, of.fragments[i].ct_from_bone, 1e-9, one.name);
  }
}

void fracture() {
  expect_mirrored_phantom(output<Phantom>("simulate.fracture", "phantom",
                                          {{"bone", shipped::item(mirrored(left_femur()))}}, fracture_options(true)),
                          left_fracture());
}

void whole() {
  const Eigen::Vector3d turn(3, -7, 20), shift(4, -5, 6);
  const auto moved = [](const Bone& bone, const Eigen::Vector3d& turn, const Eigen::Vector3d& shift) {
    return output<Phantom>("simulate.whole", "phantom", {{"bone", shipped::item(bone)}},
                           {{"rotation_deg", list_of(turn)}, {"translation_mm", list_of(shift)}});
  };
  expect_mirrored_phantom(moved(mirrored(left_femur()), mirrored_turn(turn), mirrored(shift)),
                          moved(left_femur(), turn, shift));
}

void expect_mirrored_postures(const List<Posture>& found, const List<Posture>& of) {
  ASSERT_EQ(found.size(), of.size());
  for (std::size_t i = 0; i < of.size(); ++i) {
    const std::string frame = "frame " + of.name(i);
    for (std::size_t f = 0; f < of[i].world_from_ct.size(); ++f)
      expect_mirrored(found[i].world_from_ct[f], of[i].world_from_ct[f], 1e-6, frame);
    ASSERT_EQ(found[i].bodies.size(), of[i].bodies.size());
    for (std::size_t b = 0; b < of[i].bodies.size(); ++b)
      if (of[i].bodies[b]) expect_mirrored(found[i].bodies[b].value(), *of[i].bodies[b], 1e-6, frame);
  }
}

void bone_motion() {
  const Eigen::Vector3d turn(6, 4, 60), shift(4, 3, 6);
  const auto postures = [](const Phantom& phantom, const Eigen::Vector3d& turn, const Eigen::Vector3d& shift) {
    return output_list<Posture>(
        "simulate.bone_motion", "postures", {{"phantom", shipped::item(phantom)}},
        {{"frames", std::int64_t(9)}, {"rotation_deg", list_of(turn)}, {"translation_mm", list_of(shift)}});
  };
  expect_mirrored_postures(postures(mirrored(left_fracture()), mirrored_turn(turn), mirrored(shift)),
                           postures(left_fracture(), turn, shift));
}

List<Posture> knee_postures(const ClutteredPhantom& phantom) {
  return output_list<Posture>("simulate.knee_motion", "postures", {{"phantom", shipped::item(phantom)}},
                              {{"frames", std::int64_t(9)}, {"frame_rate_hz", 10.0}, {"crossing", true}});
}

void knee_motion() { expect_mirrored_postures(knee_postures(mirrored(left_leg())), knee_postures(left_leg())); }

void clutter() {
  const auto with_knee = [](const Phantom& phantom) {
    return output<ClutteredPhantom>("simulate.clutter", "phantom", {{"phantom", shipped::item(phantom)}},
                                    {{"knee", "usual"}});
  };
  const ClutteredPhantom found = with_knee(mirrored(left_fracture())), of = with_knee(left_fracture());
  ASSERT_EQ(found.bodies.size(), of.bodies.size());
  for (std::size_t i = 0; i < of.bodies.size(); ++i) {
    const Mesh &one = found.bodies[i].surface, other = mirrored(of.bodies[i].surface);
    EXPECT_LT((fragment_frame(one).origin_mm - fragment_frame(other).origin_mm).norm(), 0.05) << of.bodies[i].name;
    EXPECT_NEAR(enclosed_volume_mm3(one) / enclosed_volume_mm3(other), 1, 2e-3) << of.bodies[i].name;
    expect_mirrored(found.bodies[i].ct_from_world, of.bodies[i].ct_from_world, 1e-6, of.bodies[i].name);
  }
}

void expect_mirrored_truths(const List<Truth>& found, const List<Truth>& of) {
  ASSERT_EQ(found.names(), of.names());
  for (std::size_t i = 0; i < of.size(); ++i)
    expect_mirrored(found[i].world_from_model, of[i].world_from_model, 1e-9, of.name(i));
}

void truth() {
  const auto known = [](const Phantom& phantom) {
    return shipped::call("simulate.truth", {{"phantom", shipped::item(phantom)}});
  };
  const auto found = known(mirrored(left_fracture())), of = known(left_fracture());
  expect_mirrored_truths(found.at("truths").as_list<Truth>(), of.at("truths").as_list<Truth>());
  const auto one = found.at("models").as_list<Mesh>(), other = of.at("models").as_list<Mesh>();
  for (std::size_t i = 0; i < other.size(); ++i)
    EXPECT_EQ(one[i].vertices_mm, mirrored(other[i]).vertices_mm) << other.name(i);
}

void bones() {
  const auto known = [](const ClutteredPhantom& phantom) {
    return shipped::call("simulate.bones", {{"phantom", shipped::item(phantom)}},
                         {{"bodies", std::vector<std::string>{"tibia"}}});
  };
  const auto found = known(mirrored(left_leg())), of = known(left_leg());
  expect_mirrored_truths(found.at("truths").as_list<Truth>(), of.at("truths").as_list<Truth>());
  const auto one = found.at("seeds").as_list<Seeds>(), other = of.at("seeds").as_list<Seeds>();
  for (std::size_t i = 0; i < other.size(); ++i)
    for (std::size_t k = 0; k < other[i].points_mm.size(); ++k)
      EXPECT_LT((one[i].points_mm[k] - mirrored(other[i].points_mm[k])).norm(), 1e-9) << other.name(i);
}

void nailing() {
  const auto implant = output<geometry::Implant>("simulate.nail", "implant", {}, {{"resolution_mm", 1.0}});
  const auto nailed = [](const ClutteredPhantom& phantom, const geometry::Implant& implant) {
    return output<Truth>("simulate.nailing", "truth",
                         {{"phantom", shipped::item(phantom)}, {"implant", shipped::item(implant)}},
                         {{"turn_deg", 0.0}, {"shift_mm", 0.0}})
        .world_from_model;
  };
  expect_mirrored(nailed(mirrored(left_leg()), mirrored(implant)), nailed(left_leg(), implant), 1e-6, "the nail");
}

void hexapod_below_fragment() {
  const Eigen::Vector3d at(3, -4, 5), stand(2, -3, 25);
  List<Pose> commands;
  for (const double angle : {0.0, 0.1}) {
    Pose pose;
    pose.world_from_model = {"platform", "platform", rotation_from_vector({angle, -0.5 * angle, angle}), {2, 3, -4}};
    commands.add("turned by " + std::to_string(angle), pose);
  }
  const auto positions = [](const Phantom& phantom, const List<Pose>& told, const Eigen::Vector3d& at,
                            const Eigen::Vector3d& stand) {
    return output_list<Truth>("simulate.hexapod", "fragment",
                              {{"phantom", shipped::item(phantom)}, {"commands", shipped::list(told, "position")}},
                              {{"fragment_at_mm", list_of(at)},
                               {"stand_deg", list_of(stand)},
                               {"leg_sd_mm", 0.0},
                               {"joint_sd_mm", 0.0},
                               {"mount_sd_deg", 0.0},
                               {"mount_sd_mm", 0.0}});
  };
  const auto found = positions(mirrored(left_fracture()), mirrored(commands), mirrored(at), mirrored_turn(stand)),
             of = positions(left_fracture(), commands, at, stand);
  for (std::size_t i = 0; i < of.size(); ++i)
    expect_mirrored(found[i].world_from_model, of[i].world_from_model, 1e-5, of.name(i));
}

Camera camera() {
  return output_list<Camera>("camera.carm", "camera", {},
                             {{"names", std::vector<std::string>{"oblique"}},
                              {"alpha_deg", std::vector<double>{10}},
                              {"beta_deg", std::vector<double>{35}},
                              {"width_px", std::int64_t(128)},
                              {"height_px", std::int64_t(160)},
                              {"pixel_mm", 2.0}})[0];
}

/// The flipped image differs by rounding alone.
template <class T>
void expect_mirrored_image(const std::string& node, const T& phantom) {
  const auto image = [&](const T& given, const Camera& camera) {
    List<Camera> cameras;
    cameras.add("oblique", camera);
    const shipped::Outputs outputs = shipped::call(
        node, {{"phantom", shipped::item(given)}, {"cameras", shipped::list(cameras, "view")}}, {{"photons", 0.0}});
    return outputs.at("views").as_list<View>()[0].image.pixels;
  };
  cv::Mat flipped;
  cv::flip(image(phantom, camera()), flipped, 1);
  const cv::Mat found = image(mirrored(phantom), mirrored(camera()));
  EXPECT_LE(cv::norm(found, flipped, cv::NORM_INF), 2);
  EXPECT_GT(cv::norm(found, image(phantom, camera()), cv::NORM_INF), 1000) << "the bone is no mirror image of itself";
}

/// Mean difference of the CT values at places all over the volume. Voxels lie otherwise beside a mirrored bone, so its
/// borders differ a little.
template <class T>
void expect_mirrored_volume(const std::string& node, const T& phantom) {
  const auto volume = [&](const T& given) {
    return output<Volume>(node, "volume", {{"phantom", shipped::item(given)}},
                          {{"noise_hu", 0.0}, {"spacing_mm", std::vector<double>{2, 2, 3}}});
  };
  const Volume of = volume(phantom), found = volume(mirrored(phantom));
  double off = 0, unmirrored = 0, count = 0;
  for (int z = 2; z + 2 < of.grid.size[2]; z += 3)
    for (int y = 2; y + 2 < of.grid.size[1]; y += 2)
      for (int x = 2; x + 2 < of.grid.size[0]; x += 2) {
        const Eigen::Vector3d at = of.grid.point_from_index(Eigen::Vector3d(x, y, z));
        const auto value = [&](const Eigen::Vector3d& point) {
          return double(sample_trilinear(found.grid, found.values, found.grid.index_from_point(point)));
        };
        const double right = of.values[of.grid.offset(x, y, z)];
        off += std::abs(value(mirrored(at)) - right), unmirrored += std::abs(value(at) - right), ++count;
      }
  EXPECT_LT(off / count, 0.2 * unmirrored / count) << off / count << " HU; not mirrored: " << unmirrored / count;
}

}  // namespace

const Bone& left_femur() {
  static const Bone made = output<Bone>("simulate.femur", "bone", {}, {{"resolution_mm", 2.0}});
  return made;
}

Options fracture_options(bool is_mirrored) {
  const Eigen::Vector3d turn(4, -6, 9), shift(5, -3, -9), proximal_turn(-2, 3, 4), proximal_shift(1, 2, 3),
      gap(0.3, 0, -2);
  const auto turned = [&](const Eigen::Vector3d& v) { return list_of(is_mirrored ? mirrored_turn(v) : v); };
  const auto moved = [&](const Eigen::Vector3d& v) { return list_of(is_mirrored ? mirrored(v) : v); };
  return {{"roughness_mm", 0.0},
          {"direction_deg", is_mirrored ? 150.0 : 30.0},
          {"ct_gap_mm", moved(gap)},
          {"rotation_deg", turned(turn)},
          {"translation_mm", moved(shift)},
          {"proximal_rotation_deg", turned(proximal_turn)},
          {"proximal_translation_mm", moved(proximal_shift)}};
}

const Phantom& left_fracture() {
  static const Phantom made =
      output<Phantom>("simulate.fracture", "phantom", {{"bone", shipped::item(left_femur())}}, fracture_options(false));
  return made;
}

const ClutteredPhantom& left_leg() {
  static const ClutteredPhantom made = [] {
    const auto whole = shipped::call("simulate.whole", {{"bone", shipped::item(left_femur())}},
                                     {{"rotation_deg", std::vector<double>{2, 3, 4}},
                                      {"translation_mm", std::vector<double>{5, -2, 3}}})
                           .at("phantom");
    return output<ClutteredPhantom>("simulate.clutter", "phantom", {{"phantom", whole}}, {{"knee", "mild"}});
  }();
  return made;
}

Checks checks_of_simulations() {
  return {
      {"simulate.bone_motion", bone_motion},
      {"simulate.bones", bones},
      {"simulate.clutter", clutter},
      {"simulate.cluttered_ct", [] { expect_mirrored_volume("simulate.cluttered_ct", left_leg()); }},
      {"simulate.cluttered_fluoroscopy", [] { expect_mirrored_image("simulate.cluttered_fluoroscopy", left_leg()); }},
      {"simulate.ct", [] { expect_mirrored_volume("simulate.ct", left_fracture()); }},
      {"simulate.femur", femur},
      {"simulate.fluoroscopy", [] { expect_mirrored_image("simulate.fluoroscopy", left_fracture()); }},
      {"simulate.fracture", fracture},
      {"simulate.hexapod", hexapod_below_fragment},
      {"simulate.knee_motion", knee_motion},
      {"simulate.nailing", nailing},
      {"simulate.truth", truth},
      {"simulate.whole", whole}};
}

}  // namespace mirrored_patient
