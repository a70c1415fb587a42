// SPDX-License-Identifier: Apache-2.0
// A mistake that people make with the data of a registration. The registration then ends in a wrong pose, and a study
// shows whether a verdict notices it.
#include <marrow/plugin.hpp>

#include "marrow/simulate/vectors.hpp"

namespace {

using namespace marrow;

struct Options {
  std::string mistake = "none";
  double camera_deg = 8, camera_mm = 8;
  int mistake_seed = 1;
};

/// The data of a registration.
struct Given {
  Volume volume;
  List<Seeds> seeds;
  List<View> views;
  List<Truth> truth;
};

/// No pose is right for a bone that the images do not show. So its truth is one metre away.
void set_far(List<Truth>& truth) {
  truth = truth.changed([](Truth& one, std::size_t) { one.world_from_model.translation_mm.x() += 1000; });
}

/// Reverses the first axis of the CT, and moves the seeds accordingly.
void mirror_ct(Given& made) {
  const Grid& grid = made.volume.grid;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y) {
      float* const row = made.volume.values.data() + grid.offset(0, y, z);
      std::reverse(row, row + grid.size[0]);
    }
  made.seeds = made.seeds.changed([&](Seeds& seeds, std::size_t) {
    for (Eigen::Vector3d& point : seeds.points_mm) {
      Eigen::Vector3d index = grid.index_from_point(point);
      index.x() = grid.size[0] - 1 - index.x();
      point = grid.point_from_index(index);
    }
  });
}

void mirror_images(List<View>& views) {
  views = views.changed([&](View& view, std::size_t i) {
    view.image.pixels = view.mask = cv::Mat();  // the given images stay as they are
    cv::flip(views[i].image.pixels, view.image.pixels, 1);
    if (!views[i].mask.empty()) cv::flip(views[i].mask, view.mask, 1);
  });
}

/// Exchanges the cameras of the first two views.
void swap_images(List<View>& views) {
  if (views.size() < 2) throw Error(formatted("swapped_views needs two views, got {}", views.size()));
  views = views.changed([&](View& view, std::size_t i) {
    if (i < 2) view.camera = views[1 - i].camera;
  });
}

/// Gives the last view the camera of another pose of the C-arm.
void move_camera(List<View>& views, const Options& options) {
  Random random{std::uint64_t(options.mistake_seed)};
  RigidTransform off{"world", "world"};
  off.rotation = rotation_from_vector(radians(options.camera_deg) * phantom::random_direction(random));
  off.translation_mm = options.camera_mm * phantom::random_direction(random);
  views = views.changed([&](View& view, std::size_t i) {
    if (i + 1 == views.size()) view.camera.camera_from_world = view.camera.camera_from_world * off;
  });
}

Given mistaken(const Volume& volume, const List<Seeds>& seeds, const List<View>& views, const List<Truth>* truth,
               const Volume* other_volume, const List<Seeds>* other_seeds, const Options& options) {
  Given made{volume, seeds, views, truth ? *truth : List<Truth>()};
  if (options.mistake == "other_bone") {
    if (!other_volume || !other_seeds)
      throw Error("the mistake other_bone needs the inputs other_volume and other_seeds, the CT of another bone");
    made.volume = *other_volume;
    made.seeds = *other_seeds;
    set_far(made.truth);
  } else if (options.mistake == "mirrored_ct") {
    mirror_ct(made);
    set_far(made.truth);
  } else if (options.mistake == "mirrored_images") {
    mirror_images(made.views);
    set_far(made.truth);
  } else if (options.mistake == "swapped_views") {
    swap_images(made.views);
  } else if (options.mistake == "wrong_camera") {
    move_camera(made.views, options);
  }
  return made;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.mistake", mistaken)
      .summary(
          "What a registration is given, with a mistake as people make it: another bone, another side, another camera")
      .in("volume", "CT")
      .in("seeds", "points inside each fragment", over("fragment"))
      .in("views", "X-ray views", over("view"))
      .in("truth", "exact pose of each fragment, where it is known", over("fragment"))
      .in("other_volume", "the CT of another bone, for the mistake other_bone")
      .in("other_seeds", "points inside each fragment of it", over("fragment"))
      .out("volume", &Given::volume, "the CT, or the wrong one")
      .out("seeds", &Given::seeds, "points inside each fragment of it", over("fragment"))
      .out("views", &Given::views, "the views, or wrong ones", over("view"))
      .out("truth", &Given::truth,
           "the exact poses. If the images do not show the bone of the CT, they are one metre away, so that every pose "
           "counts as wrong",
           over("fragment"))
      .option("mistake", &Options::mistake,
              "other_bone: the CT of another patient; mirrored_ct, mirrored_images: a bone of the other side; "
              "swapped_views: the first two images have each other's camera; wrong_camera: the last view has a camera "
              "that was taken elsewhere",
              one_of({"none", "other_bone", "mirrored_ct", "mirrored_images", "swapped_views", "wrong_camera"}))
      .option("camera_deg", &Options::camera_deg, "wrong_camera: rotation about the world's origin", at_least(0),
              at_most(180))
      .option("camera_mm", &Options::camera_mm, "wrong_camera: shift", at_least(0))
      .option("mistake_seed", &Options::mistake_seed, "seed of the directions of both", at_least(0));
}
