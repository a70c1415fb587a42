// SPDX-License-Identifier: Apache-2.0
// Checks for masks on a radiograph of a bone with a rod of metal in front of it, whose places in the image are known
// exactly. The bone stays, and so do the image, the camera and what was left out before.
#include <marrow/plugin.hpp>
#include <random>

#include "marrow/toolbox/analytic/body.hpp"
#include "marrow/toolbox/geometry/implant.hpp"

namespace {

using namespace marrow;
using namespace marrow::conformance;

constexpr int kWidth = 260, kHeight = 220;
constexpr double kPixel_mm = 0.6, kAir = 50000, kNoise = 0.01;
/// Per mm: soft tissue, bone and metal.
constexpr double kTissue = 0.02, kBone = 0.025, kMetal = 0.5;

analytic::Body bone() { return {{{0, 0, 0}, {16, 16, 60}}}; }
analytic::Body rod() {
  return {{{14, -40, 10}, {4, 4, 60}, Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()).matrix()}};
}

Camera camera() { return analytic::c_arm(0, kWidth, kHeight, kPixel_mm); }

/// Lengths of the rays through all pixels within a body.
std::vector<float> chords(const analytic::Body& body) {
  return analytic::BodyProjector(body).radiograph(camera(), {"world", "ct"}, {0, 0, 1, kWidth, kHeight});
}

View view(int type = CV_16U) {
  const std::vector<float> in_bone = chords(bone()), in_rod = chords(rod());
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  cv::Mat pixels(kHeight, kWidth, CV_32F);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const std::size_t k = std::size_t(i);
    const double direct = kAir * std::exp(-kTissue * 60 - kBone * in_bone[k] - kMetal * in_rod[k]);
    pixels.at<float>(i / kWidth, i % kWidth) = float(direct * (1 + kNoise * normal(random)) + 0.003 * kAir);
  }
  pixels.rowRange(0, 8).setTo(kAir);  // air beside the patient
  View view;
  view.name = "frontal";
  view.camera = camera();
  pixels.convertTo(view.image.pixels, type, type == CV_8U ? 1 / 257.0 : 1);
  return view;
}

geometry::Implant implant() {
  geometry::Implant implant{analytic::mesh_of(rod()), {{"hole", {14, -40, 10}, {1, 0, 0}, 5}}};
  implant.surface.frame = "implant";
  return implant;
}

Inputs inputs_of(View view) {
  Pose pose;
  pose.world_from_model = {"world", "implant"};
  return {{"view", item(std::move(view))},
          {"pose", item(pose)},
          {"implant", item(implant())},
          {"projector", Value::of<RadiographProjector>(std::make_shared<analytic::BodyProjector>(rod()))}};
}

View before() {
  View before = view();
  before.mask = cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(255));
  before.mask(cv::Rect(3, 12, 20, 30)).setTo(0);
  return before;
}

void validate(const Inputs& inputs, const std::vector<PortInfo>&, const std::vector<Value>& outputs) {
  expect(outputs.size() == 1 && !outputs[0].is_absent(), "it gives no view");
  const View &given = inputs.at("view").as<View>(), &made = outputs[0].as<View>();
  expect(made.name == given.name && made.camera.intrinsics == given.camera.intrinsics, "the view is another one");
  expect(made.image.pixels.size() == given.image.pixels.size() &&
             made.image.pixels.type() == given.image.pixels.type() &&
             std::equal(made.image.pixels.datastart, made.image.pixels.dataend, given.image.pixels.datastart),
         "the image was changed");
  expect(made.mask.type() == CV_8U && made.mask.size() == given.image.pixels.size(),
         "the mask is not CV_8U of the image's size");
  if (given.mask.empty()) return;
  for (int v = 0; v < made.mask.rows; ++v)
    for (int u = 0; u < made.mask.cols; ++u)
      expect(given.mask.at<uchar>(v, u) || !made.mask.at<uchar>(v, u), "a pixel counts again that was left out before");
}

/// Percentage of the chosen pixels that are left out.
template <class Chosen>
double left_out_percent(const Subject& subject, Chosen chosen) {
  const std::vector<float> in_bone = chords(bone()), in_rod = chords(rod());
  const View masked = subject.output(inputs_of(view()), "view").as<View>();
  double all = 0, out = 0;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const std::size_t k = std::size_t(i);
    if (i / kWidth < 20 || !chosen(in_bone[k], in_rod[k])) continue;
    ++all;
    out += masked.mask.at<uchar>(i / kWidth, i % kWidth) == 0;
  }
  return 100 * out / all;
}

/// Throws NotApplicable for a node that leaves out more than the rod, or keeps it.
void needs_metal(const Subject& subject) {
  if (subject.has_trait("keeps_what_it_finds")) throw NotApplicable("it keeps what it finds");
  for (const PortInfo& port : subject.info().inputs)
    if (port.name == "implant") throw NotApplicable("it leaves out more than the metal");
}

double metal_kept(const Subject& subject) {
  needs_metal(subject);
  return 100 - left_out_percent(subject, [](float, float in_rod) { return in_rod > 2; });
}

double bone_lost(const Subject& subject) {
  needs_metal(subject);
  // A ray that passes the rod at a distance sees none of it; near it, a margin may be left out.
  const View masked = subject.output(inputs_of(view()), "view").as<View>();
  const std::vector<float> in_bone = chords(bone()), in_rod = chords(rod());
  const int margin = 8;
  double all = 0, out = 0;
  for (int v = 20; v < kHeight - margin; ++v)
    for (int u = margin; u < kWidth - margin; ++u) {
      if (in_bone[std::size_t(v * kWidth + u)] < 1) continue;
      bool is_near = false;
      for (int y = v - margin; y <= v + margin; ++y)
        for (int x = u - margin; x <= u + margin; ++x) is_near |= in_rod[std::size_t(y * kWidth + x)] > 0;
      if (is_near) continue;
      ++all;
      out += masked.mask.at<uchar>(v, u) == 0;
    }
  return 100 * out / all;
}

std::vector<Trial> trials() {
  const auto plain = [](int width, int height) {
    return [=] {
      View plain = view();
      plain.image.pixels = cv::Mat(height, width, CV_16U, cv::Scalar(20000));
      plain.camera.width_px = width;
      plain.camera.height_px = height;
      return inputs_of(plain);
    };
  };
  return {{"empty_image", plain(0, 0)},
          {"one_pixel", plain(1, 1)},
          {"constant_image", plain(kWidth, kHeight)},
          {"another_size_than_the_camera",
           [] {
             View odd = view();
             odd.image.pixels = odd.image.pixels.rowRange(0, 100).clone();
             return inputs_of(odd);
           }},
          {"nan_pixel",
           [] {
             View odd = view(CV_32F);
             odd.image.pixels.at<float>(50, 60) = std::nanf("");
             return inputs_of(odd);
           }},
          {"eight_bits", [] { return inputs_of(view(CV_8U)); }},
          {"float_pixels", [] { return inputs_of(view(CV_32F)); }},
          {"a_mask_before", [] { return inputs_of(before()); }},
          {"a_mask_of_nothing", [] {
             View nothing = view();
             nothing.mask = cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(0));
             return inputs_of(nothing);
           }}};
}

Suite suite_of_kind() {
  Suite suite{[] { return inputs_of(before()); }, validate, trials(), {}};
  suite.add("metal_kept", "part of the rod's pixels that still count", 2, "%", metal_kept);
  suite.add("bone_lost", "part of the bone's pixels, 8 px or more away from the rod, that are left out", 2, "%",
            bone_lost);
  return suite;
}

}  // namespace

MARROW_PLUGIN(plugin) { plugin.suite("mask", suite_of_kind()); }
