#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <tbb/parallel_for.h>
#include "marrow/domain/c_arm.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/domain/functions.hpp"
#include "marrow/plugin.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"
using namespace marrow;
Volume thigh(int n) {
  Volume volume;
  volume.grid.size = {n, n, 3*n/2};
  const double mm = 256.0 / n;
  volume.grid.spacing_mm = {0.8*mm, 0.8*mm, 1.0*mm};
  volume.grid.origin_mm = -Eigen::Vector3d((n-1) * 0.4*mm, (n-1) * 0.4*mm, (3*n/2-1) * 0.5*mm);
  volume.values.resize(volume.grid.count());
  tbb::parallel_for(0, 3*n/2, [&](int z) {
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const Eigen::Vector3d p = volume.grid.point_from_index({double(x), double(y), double(z)});
        const double flare = 14 + 22 / (1 + std::exp((p.z() + 140) / 12));
        const double radius = std::hypot(p.x() - 0.0004 * p.z() * p.z(), p.y());
        auto step=[](double d){return 1/(1+std::exp(d/0.6));};
        double hu = -1000 + 2250 * step(radius-flare) - 1200*step(radius-flare+6);
        if (getenv("WHOLE")) hu=std::max(hu,40.); else if (p.norm()>150) hu=-1000;
        volume.values[volume.grid.offset(x, y, z)] = float(hu);
      }
  });
  return volume;
}
int main(int argc, char** argv) {
  const Catalogue catalogue;
  const int px = argc > 2 ? atoi(argv[2]) : 256;
  const Volume volume = thigh(argc > 3 ? atoi(argv[3]) : 128);
  const NodeDefinition& node = catalogue.load(argv[1]);
  std::vector<Value> inputs;
  for (const PortInfo& port : node.info.inputs) { Value value; value.type = port.type;
    if (port.name == "volume") value = Value::of<Volume>(std::shared_ptr<const Volume>(&volume, [](const Volume*) {}));
    inputs.push_back(value); }
  const std::shared_ptr<void> options = node.make_options();
  for (std::size_t i = 0; i < node.info.options.size(); ++i)
    node.set_option[i](options.get(), node.info.options[i].default_value);
  Context context{Context::Hooks()};
  const auto outputs = node.call(inputs, options.get(), context);
  const auto& sharp = outputs[0].as<RadiographProjector>();
  const auto smooth = argc > 4 ? sharp.smoothed(atof(argv[4])) : nullptr;
  const RadiographProjector& projector = smooth ? *smooth : sharp;
  const auto* derivatives = &projector;
  const CArm arm{px, px, Eigen::Vector2d::Constant(300.0 / px), 1000, 600, Eigen::Vector3d::Zero()};
  const Camera camera = carm_camera(arm, world_from_camera_rotation(0, 0));
  std::mt19937 random(1);
  auto uniform = [&] { return double(random()) / 4294967296.0 * 2 - 1; };
  FragmentFrame frame; frame.origin_mm = {3, 4, -100}; frame.axes = rotation_from_vector({.2,.3,.5});
  const PixelGrid grid = {0,0,1,px,px};
  if (!getenv("ONLY")) for (double h : {0.02, 0.1}) {
  double worst[6]={}, rms[6]={}, directional[6]={};
  const int poses=4;
  for (int pose = 0; pose < poses; ++pose) {
    RigidTransform at{"world", "ct", rotation_from_vector({uniform()*.3, uniform()*.3, uniform()*3}), {10*uniform(),10*uniform(),100+10*uniform()}};
    const auto e = *derivatives->expansion(camera, at, frame, grid);
    const auto v = projector.radiograph(camera, at, grid);
    double off=0; for (size_t i=0;i<v.size();++i) off=std::max(off,double(std::abs(v[i]-e.values[i])));
    if (off>1e-3) printf("values off %g\n", off);
    for (int k = 0; k < 6; ++k) {
      Vector6d m = Vector6d::Zero(); m[k] = h * (k < 3 ? 0.01 : 1);
      const auto a = projector.radiograph(camera, moved(at, frame, m), grid), b = projector.radiograph(camera, moved(at, frame, -m), grid);
      if (pose==99) for (int r=px/4;r<px;r+=px/4) for (int c=px/2-10;c<px/2+12;c+=7) { size_t i=size_t(r*px+c); printf("k%d (%d,%d) v %.3f fd %.4g slope %.4g\n",k,r,c,v[i],(a[i]-b[i])/(2*m[k]),e.slopes[k][i]); }
      double largest=0, most=0, sq=0, dir=0, dirn=0;
      for (size_t i = 0; i < a.size(); ++i) {
        const double fd = (a[i] - b[i]) / (2 * m[k]);
        largest = std::max(largest, std::abs(fd));
        most = std::max(most, std::abs(fd - e.slopes[k][i])); sq += std::pow(fd - e.slopes[k][i], 2);
        const double w = v[i] + std::sin(0.1 * double(i % px));
        dir += w * (fd - e.slopes[k][i]); dirn += std::abs(w * fd);
      }
      worst[k] = std::max(worst[k], most / largest); rms[k] = std::max(rms[k], std::sqrt(sq / a.size()) / largest);
      directional[k] = std::max(directional[k], std::abs(dir)/dirn);
    }
  }
  printf("h %g\n", h);
  for (int k = 0; k < 6; ++k) printf("%d worst %.2e rms %.2e directional %.2e\n", k, worst[k], rms[k], directional[k]);
  }
  RigidTransform at{"world", "ct", rotation_from_vector({.1,.05,.4}), {0,0,100}};
  auto time = [&](auto f) { double best=1e9; for (int i=0;i<60;++i){ auto t=std::chrono::steady_clock::now(); f(); best=std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now()-t).count()); } return best*1e3; };
  const double a = time([&]{ projector.radiograph(camera, at, grid); }), b = time([&]{ derivatives->expansion(camera, at, frame, grid); });
  printf("radiograph %.2f ms, expansion %.2f ms, ratio %.2f\n", a, b, b/a);
}
