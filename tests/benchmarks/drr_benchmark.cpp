// SPDX-License-Identifier: Apache-2.0
// drr_benchmark [FOLDER]: how long a radiograph takes, and how far it is from one by fine steps. With a folder, the
// volume, the geometry and the images are written there, for drr_peers to compare with other programs.
// drr_benchmark --batches: 64 poses at once by project.joseph and by project.opencl.
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <fstream>
#include <random>

#include "marrow/plugin.hpp"
#include "tests/benchmarks/timing.hpp"

namespace {

using namespace marrow;

/// A thigh: soft tissue that fills the volume, in it a bent hollow bone with a spongy end. Of a short run, an eighth of
/// the voxels in each direction.
Volume thigh(bool bone_only) {
  const int part = timing::is_short() ? 8 : 1;
  Volume volume;
  volume.grid.size = {256 / part, 256 / part, 384 / part};
  volume.grid.spacing_mm = part * Eigen::Vector3d(0.8, 0.8, 1.0);
  volume.grid.origin_mm = -Eigen::Vector3d(255 * 0.4, 255 * 0.4, 383 * 0.5);
  volume.values.resize(volume.grid.count());
  tbb::parallel_for(0, volume.grid.size[2], [&](int z) {
    std::mt19937 random(std::uint32_t(z) + 1);
    for (int y = 0; y < volume.grid.size[1]; ++y)
      for (int x = 0; x < volume.grid.size[0]; ++x) {
        const Eigen::Vector3d p = volume.grid.point_from_index({double(x), double(y), double(z)});
        const double flare = 14 + 22 / (1 + std::exp((p.z() + 140) / 12));
        const double radius = std::hypot(p.x() - 0.0004 * p.z() * p.z(), p.y()),
                     noise = 60.0 * (double(random()) / 4294967296.0 - 0.5);
        double hu = radius < flare ? (radius < flare - 6 ? (p.z() < -130 ? 250 : -20) : 1250) : 40;
        hu = bone_only && radius >= flare ? -1000 : hu + noise;
        volume.values[volume.grid.offset(x, y, z)] = float(std::round(hu));
      }
  });
  return volume;
}

Camera camera_of(int pixels) {
  // The detector is wholly covered by the volume.
  const CArm arm{pixels, pixels, Eigen::Vector2d::Constant(230.0 / pixels), 1000, 600, Eigen::Vector3d::Zero()};
  return carm_camera(arm, world_from_camera_rotation(0, 0));
}

std::shared_ptr<const RadiographProjector> projector(const Catalogue& catalogue, const std::string& name,
                                                     const Volume& volume, double step_mm = 0) {
  const NodeDefinition& node = timing::node(catalogue, name);
  std::vector<Value> inputs;
  for (const PortInfo& port : node.info.inputs) {
    Value value;
    value.type = port.type;
    if (port.name == "volume") value = Value::of<Volume>(std::shared_ptr<const Volume>(&volume, [](const Volume*) {}));
    if (port.name == "views") {
      List<View> views;
      views.add("frontal", View{"frontal", {}, camera_of(512), {}});
      value = Value::of(views, "view");
    }
    inputs.push_back(value);
  }
  const std::shared_ptr<void> options = node.make_options();
  for (std::size_t i = 0; i < node.info.options.size(); ++i)
    node.set_option[i](options.get(), node.info.options[i].name == "step_mm" && step_mm > 0
                                          ? OptionValue(step_mm)
                                          : node.info.options[i].default_value);
  Context::Hooks hooks;
  hooks.log = [](std::string_view message, marrow::LogLevel) {
    std::printf("%.*s\n", int(message.size()), message.data());
  };
  Context context(std::move(hooks));
  return std::static_pointer_cast<const RadiographProjector>(node.call(inputs, options.get(), context).at(0).data);
}

double median_ms(const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < timing::rounds(9); ++i) times.push_back(timing::milliseconds(work));
  return timing::median(times);
}

void write(const std::filesystem::path& path, const void* data, std::size_t bytes) {
  std::ofstream(path, std::ios::binary).write(static_cast<const char*>(data), std::streamsize(bytes));
}

void write_volume(const std::filesystem::path& path, const Volume& volume) {
  const std::vector<std::int16_t> values(volume.values.begin(), volume.values.end());
  std::ofstream stream(path, std::ios::binary);
  const Eigen::Vector3i size(volume.grid.size.data());
  stream << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nTransformMatrix = 1 0 0 "
            "0 1 0 0 0 1\nOffset = "
         << volume.grid.origin_mm.transpose() << "\nElementSpacing = " << volume.grid.spacing_mm.transpose()
         << "\nDimSize = " << size.transpose() << "\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  stream.write(reinterpret_cast<const char*>(values.data()), std::streamsize(2 * values.size()));
}

/// 2000 anywhere in an image of 512 x 512.
std::vector<Eigen::Vector2f> pixels() {
  std::vector<Eigen::Vector2f> sparse;
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) sparse.emplace_back(float(random() % 512), float(random() % 512));
  return sparse;
}

double rms(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(double(a[i]) - double(b[i]), 2);
  return std::sqrt(sum / double(a.size()));
}

/// Looked up, of a bone that is turned by a few degrees against what was kept; `fine` draws the truth.
void lookup(const Catalogue& catalogue, const Volume& volume, const std::string& what, const RadiographProjector& fine,
            const char* folder) {
  const timing::Stopwatch stopwatch;
  const auto one = projector(catalogue, "project.lightfield", volume);
  const double processor_s = stopwatch.processor_s(), made_s = stopwatch.seconds();
  if (folder) {
    const auto values = one->radiograph(camera_of(256), {"world", "ct"}, PixelGrid{0, 0, 1, 256, 256});
    write(std::filesystem::path(folder) / (what + "_lightfield_256.f32"), values.data(), 4 * values.size());
  }
  const RigidTransform turned{"world", "ct", rotation_from_vector({0.05, -0.03, 0.06}), {3, -2, 4}};
  const PixelGrid grid{0, 0, 1, 512, 512}, some{0, 0, 2, 256, 256};
  const Camera camera = camera_of(512);
  std::vector<float> values;
  const double ms = median_ms([&] { values = one->radiograph(camera, turned, grid); });
  const auto sparse = pixels();
  RigidTransform other = turned;
  const double sparse_ms = median_ms([&] {  // each time other integrals, that no cache holds yet
    other.rotation = rotation_from_vector({0.011, 0.013, -0.017}) * other.rotation;
    one->radiograph(camera, other, sparse);
  });
  std::printf(
      "%-6s lightfield     made in %.1f s, %.1f s of processors; 512 x 512: %.2f ms; 2000 pixels: %.3f ms; root mean "
      "square error %.4f mm of water\n",
      what.c_str(), made_s, processor_s, ms, sparse_ms,
      rms(one->radiograph(camera, turned, some), fine.radiograph(camera, turned, some)));
}

/// 64 poses near each other, several at a time, as a search computes them: wall clock and time of all processors, as
/// multiples of those of project.joseph, in turns.
void batches(const Catalogue& catalogue, const Volume& volume) {
  const int kPoses = timing::rounds(64), kTurns = timing::rounds(3);
  const Camera camera = camera_of(512);
  const PixelGrid grid{0, 0, 1, 512, 512};
  std::vector<RigidTransform> poses;
  std::mt19937 random(5);
  const auto offset = [&](double most) { return most * (2 * double(random()) / 4294967296.0 - 1); };
  for (int i = 0; i < kPoses; ++i) {
    const Eigen::Vector3d turn(offset(0.1), offset(0.1), offset(0.1)), shift_mm(offset(5), offset(5), offset(5));
    poses.push_back({"world", "ct", rotation_from_vector(turn), shift_mm});
  }
  const auto joseph = projector(catalogue, "project.joseph", volume),
             opencl = projector(catalogue, "project.opencl", volume);
  for (const bool with_slopes : {false, true}) {
    const auto times_s = [&](const RadiographProjector& one) {
      const timing::Stopwatch stopwatch;
      tbb::parallel_for(0, kPoses, [&](int i) {
        const RigidTransform& pose = poses[std::size_t(i)];
        if (with_slopes)
          one.expansion(camera, pose, FragmentFrame(), grid);
        else
          one.radiograph(camera, pose, grid);
      });
      return std::array{stopwatch.seconds(), stopwatch.processor_s()};
    };
    for (int turn = 0; turn < kTurns; ++turn) {
      const auto theirs = times_s(*joseph), ours = times_s(*opencl);
      std::printf(
          "thigh  64 poses%s, 512 x 512: joseph %.2f s, %.2f s of processors; opencl %.2f and %.2f times these\n",
          with_slopes ? " with derivatives" : "", theirs[0], theirs[1], ours[0] / theirs[0], ours[1] / theirs[1]);
      std::fflush(stdout);
    }
  }
}

/// Times and errors of all projectors; with a folder, its images.
void each_projector(const Catalogue& catalogue, const char* folder) {
  const RigidTransform world_from_model{"world", "ct"};
  for (const bool bone_only : {false, true}) {
    const Volume volume = thigh(bone_only);
    const std::string what = bone_only ? "bone" : "thigh";
    if (folder) write_volume(std::filesystem::path(folder) / (what + ".mha"), volume);
    const auto fine = projector(catalogue, "project.ray_casting", volume, 0.05);
    for (const std::string name : {"joseph", "ray_casting", "siddon_jacobs"}) {
      const auto one = projector(catalogue, "project." + name, volume);
      for (const int pixels : {512, 256}) {
        const Camera camera = camera_of(pixels);
        const PixelGrid grid{0, 0, 1, pixels, pixels};
        std::vector<float> values;
        const double ms = median_ms([&] { values = one->radiograph(camera, world_from_model, grid); });
        if (folder)
          write(std::filesystem::path(folder) / (what + "_" + name + "_" + std::to_string(pixels) + ".f32"),
                values.data(), 4 * values.size());
        std::printf("%-6s %-14s %d x %d: %7.2f ms", what.c_str(), name.c_str(), pixels, pixels, ms);
        if (pixels == 256) {  // the reference takes too long at twice the size
          const auto reference = fine->radiograph(camera, world_from_model, grid);
          std::printf(", root mean square error %.4f mm of water", rms(values, reference));
          if (folder)
            write(std::filesystem::path(folder) / (what + "_reference_256.f32"), reference.data(),
                  4 * reference.size());
        }
        std::printf("\n");
      }
      const auto sparse = pixels();
      std::printf("%-6s %-14s 2000 pixels: %.3f ms\n", what.c_str(), name.c_str(),
                  median_ms([&] { one->radiograph(camera_of(512), world_from_model, sparse); }));
    }
    lookup(catalogue, volume, what, *fine, folder);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 2);
  return timing::exit_code_of([&] {
    const Catalogue catalogue;
    if (argc > 1 && std::string(argv[1]) == "--batches")
      batches(catalogue, thigh(false));
    else
      each_projector(catalogue, argc > 1 ? argv[1] : nullptr);
    return 0;
  });
}
