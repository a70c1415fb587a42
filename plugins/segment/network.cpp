// SPDX-License-Identifier: Apache-2.0
// A trained network says of each voxel how probable bone is, slice by slice. The fragments grow from their seeds in
// this map: the most probable voxels join first (watershed by flooding: Meyer, Topographic distance and watershed
// lines, Signal Processing 38, 1994). So fragments that touch meet where the network is least sure, in the gap between
// them. The surface passes where the probability, interpolated between the voxels, crosses its threshold.
#include <tbb/parallel_for.h>

#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/segment/fragments.hpp"
#include "marrow/toolbox/network/inference.hpp"

namespace {

using namespace marrow;

struct Options {
  std::filesystem::path network;
  std::vector<std::string> bone{"bone"};
  double probability = 0.5;
  double band_mm = 4;
};

/// Probabilities are kept as parts of 1000, so that they suit what is made for Hounsfield units.
constexpr double kCertain = 1000;
constexpr int kSlicesAtOnce = 32;
constexpr double kMostPixels = 64e6;

/// The size of a slice in the network's pixels.
cv::Size network_size(const Grid& grid, const network::Input& input) {
  double sides[2];
  for (int k = 0; k < 2; ++k) {
    const double step = input.pixel_px > 0 ? input.pixel_px : input.pixel_mm / grid.spacing_mm[k];
    sides[k] = std::max(1.0, std::round(grid.size[std::size_t(k)] / step));
  }
  if (!(sides[0] * sides[1] <= kMostPixels))
    throw Error(
        formatted("volume: slices of {} x {} voxels would be {:.0f} x {:.0f} pixels for the network, which is "
                  "too many; is the spacing of the voxels right?",
                  grid.size[0], grid.size[1], sides[0], sides[1]));
  return {int(sides[0]), int(sides[1])};
}

/// A slice and its neighbours as the network takes them. Beyond the ends of the CT its last slice is repeated.
std::vector<cv::Mat> planes_of(const Volume& volume, int z, const cv::Size& size, const network::Input& input) {
  const Grid& grid = volume.grid;
  std::vector<cv::Mat> planes;
  for (int k = -(input.slices / 2); k <= input.slices / 2; ++k) {
    const int at = std::clamp(z + k, 0, grid.size[2] - 1);
    // OpenCV takes no constant memory, but only reads it.
    const cv::Mat slice(grid.size[1], grid.size[0], CV_32F, const_cast<float*>(&volume.values[grid.offset(0, 0, at)]));
    cv::Mat plane;
    const bool is_smaller = size.width < slice.cols || size.height < slice.rows;
    cv::resize(slice, plane, size, 0, 0, is_smaller ? cv::INTER_AREA : cv::INTER_LINEAR);
    planes.push_back(network::normalised(plane, {}, input));
  }
  return planes;
}

/// Writes a map of the network, made of an image of `size`, into a slice of the volume.
void into_slice(const cv::Mat& map, const cv::Size& size, int stride_px, Volume& volume, int z) {
  const Grid& grid = volume.grid;
  cv::Mat slice(grid.size[1], grid.size[0], CV_32F, &volume.values[grid.offset(0, 0, z)]);
  const double step_x = double(slice.cols) / size.width * stride_px,
               step_y = double(slice.rows) / size.height * stride_px;
  const cv::Matx23d map_from_slice(1 / step_x, 0, 0.5 / step_x - 0.5, 0, 1 / step_y, 0.5 / step_y - 0.5);
  cv::warpAffine(map, slice, map_from_slice, slice.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
}

/// How probable bone is in each voxel, from 0 to kCertain.
Volume probabilities(const Volume& volume, const Options& options, Context& context) {
  const network::Network network(network::read_description(options.network));
  const network::Input& input = network.description().input;
  network::expect_values(network.description(), {network::Values::hounsfield}, "segment.network");
  const network::Output& output = network::output_of(network.description(), network::Output::Kind::classes);
  const std::vector<std::size_t> channels = network::channels_of_classes(network.description(), output, options.bone);
  const cv::Size size = network_size(volume.grid, input);
  Volume result{volume.grid, std::vector<float>(volume.grid.count())};
  const int slices = volume.grid.size[2];
  for (int first = 0; first < slices; first += kSlicesAtOnce) {
    context.progress(0.8 * first / slices, formatted("slice {} of {}", first + 1, slices));
    tbb::parallel_for(first, std::min(first + kSlicesAtOnce, slices), [&](int z) {
      const std::vector<cv::Mat> maps = network.maps(planes_of(volume, z, size, input), output, context);
      cv::Mat sum = cv::Mat::zeros(maps[0].size(), CV_32F);
      for (const std::size_t channel : channels) sum += maps[channel];
      into_slice(sum * kCertain, size, output.stride_px, result, z);
    });
  }
  return result;
}

/// The regions of all fragments, which grow at the same time in steps of falling probability.
class Flood {
 public:
  Flood(const Volume& bone, double least)
      : bone_(bone), least_(float(least)), owner_(bone.values.size(), segment::kNobody) {}

  /// Adds the voxels of bone around a seed. Returns the greatest probability there.
  float start(const Eigen::Vector3d& seed, std::uint8_t fragment) {
    const int x = int(std::lround(seed.x())), y = int(std::lround(seed.y())), z = int(std::lround(seed.z()));
    float most = 0;
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          if (!bone_.grid.contains(x + i, y + j, z + k)) continue;
          const std::size_t at = bone_.grid.offset(x + i, y + j, z + k);
          most = std::max(most, bone_.values[at]);
          claim(at, fragment);
        }
    return most;
  }

  std::vector<std::uint8_t> run(const Context& context) {
    int level = kLevels - 1;
    for (std::size_t step = 0; level >= 0; ++step) {
      if (step % 1000000 == 0) context.check_cancelled();
      auto& waiting = waiting_[std::size_t(level)];
      if (waiting.empty()) {
        --level;
        continue;
      }
      const auto [at, fragment] = waiting.front();
      waiting.pop_front();
      // A voxel behind a less probable one waits in the level that the flood has reached.
      segment::for_neighbours(bone_.grid, at,
                              [&, fragment = fragment](std::size_t next) { claim(next, fragment, level); });
    }
    return std::move(owner_);
  }

 private:
  static constexpr int kLevels = 101;
  struct Reached {
    std::size_t at;
    std::uint8_t fragment;
  };

  void claim(std::size_t at, std::uint8_t fragment, int highest = kLevels - 1) {
    if (owner_[at] != segment::kNobody || bone_.values[at] < least_) return;
    owner_[at] = fragment;
    const int level = int(bone_.values[at] * float((kLevels - 1) / kCertain));
    waiting_[std::size_t(std::clamp(level, 0, highest))].push_back({at, fragment});
  }

  const Volume& bone_;
  float least_;
  std::vector<std::uint8_t> owner_;
  std::array<std::deque<Reached>, kLevels> waiting_;
};

std::vector<std::uint8_t> owners(const Volume& volume, const Volume& bone, const List<Seeds>& seeds,
                                 const Options& options, const Context& context) {
  const auto indices = segment::seed_indices(volume, seeds, -std::numeric_limits<double>::max());
  Flood flood(bone, kCertain * options.probability);
  for (std::size_t f = 0; f < seeds.size(); ++f) {
    float most = 0;
    for (const Eigen::Vector3d& index : indices[f]) most = std::max(most, flood.start(index, std::uint8_t(f)));
    if (most < kCertain * options.probability)
      throw Error(
          formatted("seeds of fragment '{}': the network sees no bone at any of them; its greatest probability "
                    "there is {:.2f}, at least {:.2f} expected. Move a point into bone, lower probability, or "
                    "use a network that was trained for such a CT",
                    seeds.name(f), most / kCertain, options.probability));
  }
  return flood.run(context);
}

List<SignedField> network_fields(const Volume& volume, const List<Seeds>& seeds, const Options& options,
                                 Context& context) {
  check_volume(volume, "volume");
  const Volume bone = probabilities(volume, options, context);
  const std::vector<std::uint8_t> owner = owners(volume, bone, seeds, options, context);
  std::vector<SignedField> fields;
  for (std::size_t f = 0; f < seeds.size(); ++f) {
    if (!seeds[f].wanted) continue;
    context.check_cancelled();
    context.progress(0.8 + 0.2 * double(f) / double(seeds.size()), seeds.name(f));
    const segment::Mask mask =
        segment::solid_of(volume.grid, owner, seeds, f, segment::margin(volume.grid, options.band_mm));
    fields.push_back(segment::field_at_threshold(bone, mask, kCertain * options.probability, options.band_mm));
  }
  return segment::list_of(seeds, std::move(fields));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.network", network_fields)
      .summary("A trained network finds bone slice by slice; it is divided between the fragments from their seeds")
      .in("volume", "CT in Hounsfield units; its slices lie along its third axis")
      .in("seeds", "points inside each fragment", over("fragment"))
      .out("field", "signed distance to the outer surface of each wanted fragment", over("fragment"))
      .option("network", &Options::network,
              "the network's description, a YAML file with the output 'classes'; its ONNX file lies beside it",
              required(), beside({".onnx"}))
      .option("bone", &Options::bone, "classes that are bone; their probabilities add up")
      .relation(at_least_one({"bone"}))
      .option("probability", &Options::probability, "the surface is where the probability of bone crosses this value",
              at_least(0.01), at_most(0.99))
      .option("band_mm", &Options::band_mm, "larger distances are clamped to this", at_least(1), at_most(50));
}
