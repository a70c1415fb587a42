// SPDX-License-Identifier: Apache-2.0
// X-ray images of the phantom, with exact path lengths through its continuous surfaces, several energies, quantum
// noise, scatter and the blur of the detector.
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "marrow/domain/random.hpp"
#include "marrow/simulate/posture.hpp"
#include "marrow/simulate/solid.hpp"

namespace {

using namespace marrow;
using phantom::ClutteredPhantom, phantom::Interval, phantom::Phantom, phantom::Posture;

struct FluoroscopyOptions {
  double photons = 2000;
  double blur_px = 0.8;
  double scatter_to_primary = 0.5, scatter_px = 70;
};

constexpr int kSubsamples = 2;         // rays per pixel in each direction
constexpr int kBandRows = 8;           // image rows rendered by one task
constexpr double kTissueGrey = 12000;  // grey value behind soft tissue alone; the largest is 65535
constexpr double kNearestMm = 10;

/// The share of each energy in the detected signal, for a 70 kV beam behind 3.5 mm of aluminium with a mean of 49 keV.
constexpr phantom::Spectrum kShare{0.40, 0.33, 0.20, 0.07};

/// Lengths in tissue, and the exponent of the attenuation by everything else.
struct Lengths {
  double bone = 0, marrow = 0, muscle = 0, fat = 0;
  phantom::Spectrum others{};
};

/// Share of the beam that passes through these lengths.
double transmission(const Lengths& mm) {
  double sum = 0;
  for (std::size_t e = 0; e < kShare.size(); ++e)
    sum +=
        kShare[e] * std::exp(-(phantom::kBonePerMm[e] * mm.bone + phantom::kMarrowPerMm[e] * mm.marrow +
                               phantom::kMusclePerMm[e] * mm.muscle + phantom::kFatPerMm[e] * mm.fat + mm.others[e]));
  return sum;
}

/// The line from the source through a point of the detector, scaled so that its parameter is the depth in the camera.
struct Ray {
  Eigen::Vector3d source, direction;
  double mm_per_depth;
};

class XRay {
 public:
  XRay(const ClutteredPhantom& cluttered, const Camera& camera)
      : cluttered_(cluttered),
        phantom_(cluttered.phantom),
        camera_(camera),
        fill_(phantom_.bone),
        detector_to_ray_(camera.intrinsics.inverse()),
        rays_(phantom_, camera.width_px * kSubsamples, camera.height_px * kSubsamples,
              [&](const phantom::Fragment& fragment) { return map(fragment); }),
        body_rays_(others_of(cluttered), rays_.bundle().columns(), rays_.bundle().rows(),
                   [&](const phantom::Body& body) {
                     return map(camera_.camera_from_world, "'" + body.name + "'", "where it is placed");
                   }) {
    for (const phantom::Body* body : others_of(cluttered)) materials_.push_back(phantom::material(body->material));
    for (const auto& fragment : phantom_.fragments) bone_from_world_.push_back(inverse(fragment.world_from_bone()));
  }

  const phantom::SolidRays& rays() const { return rays_; }

  Ray ray(int column, int row) const {
    const Eigen::Vector2d pixel((column + 0.5) / kSubsamples - 0.5, (row + 0.5) / kSubsamples - 0.5);
    const Eigen::Vector3d in_camera = detector_to_ray_ * pixel.homogeneous();
    return {source_position_mm(camera_), camera_.camera_from_world.rotation.transpose() * in_camera, in_camera.norm()};
  }

  Lengths soft_tissue(const Ray& ray) const {
    const auto& bone = phantom_.bone;
    const auto inside = [&](double radius) {
      const auto [from, to] = phantom::through_cylinder(bone.thigh_centre_mm, radius, ray.source, ray.direction);
      return std::max(0.0, to - std::max(0.0, from)) * ray.mm_per_depth;
    };
    Lengths lengths;
    if (!(bone.thigh_radius_mm > 0)) return lengths;
    lengths.muscle = bone.thigh_radius_mm > bone.fat_mm ? inside(bone.thigh_radius_mm - bone.fat_mm) : 0;
    lengths.fat = inside(bone.thigh_radius_mm) - lengths.muscle;
    return lengths;
  }

  /// Adds the bone between the crossings of a ray, and subtracts its length from the muscle.
  void add_bone(const Ray& ray, const std::vector<Interval>& intervals, Lengths& lengths) const {
    for (const Interval& interval : intervals) add_bone(ray, interval, -1 / interval.from, -1 / interval.to, lengths);
    lengths.muscle = std::max(0.0, lengths.muscle - lengths.bone - lengths.marrow);
  }

  /// The lengths along a ray that also crosses bodies, or soft tissue that is not a cylinder.
  Lengths among_others(const Ray& ray, const std::vector<Interval>& bone,
                       const std::vector<phantom::BodyInterval>& others) const {
    constexpr int kBoneRank = 1000;
    const std::size_t tissues = cluttered_.tissues.size();
    std::vector<phantom::Layer> layers;
    if (tissues == 0 && phantom_.bone.thigh_radius_mm > 0) {
      const auto inside = [&](double radius, int rank) {
        const auto [from, to] =
            phantom::through_cylinder(phantom_.bone.thigh_centre_mm, radius, ray.source, ray.direction);
        if (to > 0) layers.push_back({std::max(0.0, from), to, rank});
      };
      inside(phantom_.bone.thigh_radius_mm, -2);
      if (phantom_.bone.thigh_radius_mm > phantom_.bone.fat_mm)
        inside(phantom_.bone.thigh_radius_mm - phantom_.bone.fat_mm, -1);
    }
    for (std::size_t i = 0; i < bone.size(); ++i) layers.push_back({-1 / bone[i].from, -1 / bone[i].to, kBoneRank, i});
    for (const phantom::BodyInterval& other : others) {
      const std::size_t body = std::size_t(other.body);
      layers.push_back({-1 / other.from, -1 / other.to, other.body + (body < tissues ? 0 : kBoneRank + 1), body});
    }
    Lengths lengths;
    phantom::visit_layers(layers, [&](const phantom::Layer& layer, double from, double to) {
      const double length = (to - from) * ray.mm_per_depth;
      if (layer.rank == kBoneRank)
        add_bone(ray, bone[layer.index], from, to, lengths);
      else if (layer.rank < 0)
        (layer.rank == -1 ? lengths.muscle : lengths.fat) += length;
      else
        for (std::size_t e = 0; e < kShare.size(); ++e) lengths.others[e] += materials_[layer.index].per_mm[e] * length;
    });
    return lengths;
  }

  /// Computes the mean transmission of each pixel's rays, for the rows first to last - 1.
  void render(int first, int last, cv::Mat1d& primary) const {
    const auto crossings = rays_.bundle().crossings(first * kSubsamples, last * kSubsamples);
    const auto others = body_rays_.bundle().crossings(first * kSubsamples, last * kSubsamples);
    std::size_t next = 0, next_other = 0;
    std::vector<Interval> intervals;
    std::vector<phantom::BodyInterval> body_intervals;
    for (int row = first * kSubsamples; row < last * kSubsamples; ++row)
      for (int column = 0; column < rays_.bundle().columns(); ++column) {
        const Ray line = ray(column, row);
        rays_.intervals(of_ray(crossings, column, row, next), intervals);
        const auto met = of_ray(others, column, row, next_other);
        Lengths lengths;
        if (met.empty() && cluttered_.tissues.empty()) {
          lengths = soft_tissue(line);
          add_bone(line, intervals, lengths);
        } else {
          body_rays_.intervals(met, body_intervals);
          lengths = among_others(line, intervals, body_intervals);
        }
        primary(row / kSubsamples, column / kSubsamples) += transmission(lengths) / (kSubsamples * kSubsamples);
      }
  }

 private:
  static std::vector<const phantom::Body*> others_of(const ClutteredPhantom& cluttered) {
    std::vector<const phantom::Body*> others;
    for (const auto* bodies : {&cluttered.tissues, &cluttered.bodies})
      for (const phantom::Body& body : *bodies) others.push_back(&body);
    return others;
  }

  /// The crossings of one ray, from `next` on. Moves `next` behind them.
  static std::span<const phantom::Crossing> of_ray(const std::vector<phantom::Crossing>& crossings, int column, int row,
                                                   std::size_t& next) {
    const std::size_t begin = next;
    while (next < crossings.size() && int(crossings[next].row) == row && int(crossings[next].column) == column) ++next;
    return {crossings.data() + begin, next - begin};
  }

  void add_bone(const Ray& ray, const Interval& interval, double from, double to, Lengths& lengths) const {
    const double length = (to - from) * ray.mm_per_depth;
    double fraction = 1;
    if (!interval.cortical) {
      const RigidTransform& bone_from_world = bone_from_world_[std::size_t(interval.fragment)];
      fraction = fill_.mean((bone_from_world * (ray.source + from * ray.direction)).z(),
                            (bone_from_world * (ray.source + to * ray.direction)).z());
    }
    lengths.bone += fraction * length;
    lengths.marrow += (1 - fraction) * length;
  }

  phantom::SolidRays::Map map(const phantom::Fragment& fragment) const {
    return map(camera_.camera_from_world * fragment.world_from_bone(), "fragment '" + fragment.name + "'",
               "the fragment's translation");
  }

  /// The map from a body's frame to ray coordinates. `name` and `place` are for a message.
  phantom::SolidRays::Map map(const RigidTransform& camera_from_body, const std::string& name,
                              const std::string& place) const {
    return [this, camera_from_body, name, place](const Eigen::Vector3d& point) {
      const Eigen::Vector3d x = camera_from_body * point;
      if (!(x.z() >= kNearestMm))
        throw Error(
            formatted("simulate.fluoroscopy: {} reaches to {:f} mm from the X-ray source; it must lie in front of the "
                      "source, so check the camera's distances and {}",
                      name, x.z(), place));
      const Eigen::Vector2d pixel = (camera_.intrinsics * x).hnormalized();
      return phantom::RayVertex{(pixel.x() + 0.5) * kSubsamples - 0.5, (pixel.y() + 0.5) * kSubsamples - 0.5,
                                -1 / x.z()};
    };
  }

  const ClutteredPhantom& cluttered_;
  const Phantom& phantom_;
  const Camera& camera_;
  phantom::Fill fill_;
  Eigen::Matrix3d detector_to_ray_;
  phantom::SolidRays rays_;
  phantom::BodyRays body_rays_;
  std::vector<phantom::Material> materials_;  ///< of each body that is not bone
  std::vector<RigidTransform> bone_from_world_;
};

cv::Mat1d primary_image(const XRay& xray, const Camera& camera, Context& context) {
  cv::Mat1d primary(camera.height_px, camera.width_px, 0.0);
  const int bands = (camera.height_px + kBandRows - 1) / kBandRows;
  tbb::parallel_for(0, bands, [&](int band) {
    context.check_cancelled();
    xray.render(band * kBandRows, std::min(camera.height_px, (band + 1) * kBandRows), primary);
  });
  return primary;
}

/// Scatter as the blurred image of its source. The source is T ln(1 / T) for a transmission T: 0 in air, little behind
/// thick tissue (Ohnesorge, Flohr, Klingenbeck-Regn, Eur. Radiol. 1999). It is scaled so that the ratio of scattered to
/// primary radiation is the wanted one behind wide soft tissue.
cv::Mat1d scatter_image(const cv::Mat1d& primary, const FluoroscopyOptions& options, double behind_tissue) {
  if (options.scatter_to_primary == 0 || !(behind_tissue < 1)) return cv::Mat1d(primary.size(), 0.0);
  constexpr int kShrink = 8;  // computed at an eighth of the size, where the blur is still many pixels wide
  cv::Mat1d source = primary.clone(), small, scatter;
  for (double& t : source) t *= std::log(1 / t);
  cv::resize(source, small, {std::max(1, primary.cols / kShrink), std::max(1, primary.rows / kShrink)}, 0, 0,
             cv::INTER_AREA);
  const double sigma_px = options.scatter_px / kShrink;
  cv::GaussianBlur(small, small, {0, 0}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  cv::resize(small, scatter, primary.size(), 0, 0, cv::INTER_LINEAR);
  return options.scatter_to_primary / std::log(1 / behind_tissue) * scatter;
}

/// Draws the photons of each pixel from the pixel's own stream of random numbers.
void add_quantum_noise(cv::Mat1d& expected, std::uint64_t seed) {
  tbb::parallel_for(0, expected.rows, [&](int row) {
    for (int column = 0; column < expected.cols; ++column) {
      marrow::Random random(seed, std::uint64_t(row) << 32 | std::uint64_t(column));
      double& photons = expected(row, column);
      if (photons > 0) photons = double(std::poisson_distribution<std::int64_t>(photons)(random));
    }
  });
}

View expose(const std::string& name, const ClutteredPhantom& cluttered, const Camera& camera,
            const FluoroscopyOptions& options, std::uint64_t seed, Context& context) {
  check_camera(camera, "simulate.fluoroscopy: camera '" + name + "'");
  const XRay xray(cluttered, camera);
  const phantom::Bone& bone = cluttered.phantom.bone;
  cv::Mat1d signal = primary_image(xray, camera, context);
  // Exposure control: the dose is such that the wanted number of photons arrives behind the thickest soft tissue.
  const double radius = std::max(bone.thigh_radius_mm, 0.0), fat = std::min(bone.fat_mm, radius);
  const double tissue = transmission({0, 0, 2 * (radius - fat), 2 * fat});
  signal += scatter_image(signal, options, tissue);
  const double behind_tissue = tissue * (1 + options.scatter_to_primary);
  if (options.photons > 0) {
    signal *= options.photons / behind_tissue;
    add_quantum_noise(signal, seed);
    signal *= 1 / options.photons;
  } else {
    signal *= 1 / behind_tissue;
  }
  if (options.blur_px > 0)
    cv::GaussianBlur(signal, signal, {0, 0}, options.blur_px, options.blur_px, cv::BORDER_REPLICATE);
  View view;
  view.name = name;
  view.camera = camera;
  signal.convertTo(view.image.pixels, CV_16U, kTissueGrey);  // saturates in air, like a detector
  return view;
}

List<View> cluttered_fluoroscopy(const ClutteredPhantom& given, const List<Camera>& cameras, const Posture* posture,
                                 const FluoroscopyOptions& options, Context& context) {
  phantom::check_phantom(given, "simulate.fluoroscopy");
  const ClutteredPhantom phantom = phantom::in_posture(given, posture);
  List<View> views;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const std::uint64_t seed = marrow::Random(context.seed(), i)();
    views.add(cameras.name(i), expose(cameras.name(i), phantom, cameras[i], options, seed, context));
    context.progress(double(i + 1) / double(cameras.size()), "views");
  }
  return views;
}

List<View> fluoroscopy(const Phantom& phantom, const List<Camera>& cameras, const Posture* posture,
                       const FluoroscopyOptions& options, Context& context) {
  return cluttered_fluoroscopy({phantom, {}, {}}, cameras, posture, options, context);
}

/// Declares what both nodes have in common.
void declare(auto&& node) {
  node.random()
      .in("cameras", "camera of each view", over("view"))
      .in("posture", "posture of the phantom; if not given, its own")
      .out("views", "16-bit images, bright = air", over("view"))
      .option("photons", &FluoroscopyOptions::photons, "photons per pixel behind soft tissue alone; 0: no noise",
              at_least(0), unit("1/px"))
      .option("blur_px", &FluoroscopyOptions::blur_px, "standard deviation of the detector's blur", at_least(0),
              at_most(10))
      .option("scatter_to_primary", &FluoroscopyOptions::scatter_to_primary,
              "ratio of scattered to primary radiation behind soft tissue", at_least(0), at_most(5))
      .option("scatter_px", &FluoroscopyOptions::scatter_px,
              "standard deviation of the Gaussian that spreads the scatter", at_least(8));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare(plugin.node("simulate.fluoroscopy", fluoroscopy)
              .summary("Simulates X-ray images of a bone from exact path lengths at several energies, with noise, "
                       "scatter and blur")
              .in("phantom", "bone, fracture and fragments"));
  declare(plugin.node("simulate.cluttered_fluoroscopy", cluttered_fluoroscopy)
              .summary("Simulates X-ray images like simulate.fluoroscopy, with what else is in the beam")
              .in("phantom", "phantom with tissues and bodies"));
}
