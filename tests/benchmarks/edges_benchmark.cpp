// SPDX-License-Identifier: Apache-2.0
// edges.adaptive_relaxation on 16 bits against OpenCV's Canny with its blur on 8 bits: the same 1024 x 1024 radiograph,
// the same threads, in turns. The extractor measures noise, percentiles of a moving window and sub-pixel positions
// besides; it may take ten times as long. Exit code 1 when it takes longer.
#include <tbb/global_control.h>

#include <opencv2/imgproc.hpp>

#include "tests/benchmarks/timing.hpp"
#include "tests/plugins/edges/radiograph.hpp"

namespace {

constexpr int kSize_px = 1024, kRounds = 31;
constexpr double kLimit = 10, kSigma_px = 1.5;
constexpr double kLow = 16, kHigh = 40;  // with which both find as many edges

using timing::median, timing::milliseconds;

int run(const std::string& name, int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
  cv::setNumThreads(threads);
  const marrow::View view = radiograph::image("frontal", radiograph::camera(0, kSize_px),
                                              radiograph::shaft({5, 3, 0}, {0.08, 0.05, 1}), 2000, 7);
  cv::Mat eight_bits;  // exposed for the limb; air saturates
  view.image.pixels.convertTo(eight_bits, CV_8U, 255.0 / 8000);

  const marrow::Catalogue catalogue;
  const marrow::NodeDefinition& node = timing::node(catalogue, name);
  const std::shared_ptr<void> options = node.make_options();
  const std::vector<marrow::Value> inputs{marrow::Value::of(std::make_shared<const marrow::View>(view))};
  marrow::Context context(1);
  std::size_t edges = 0;
  int canny_edges = 0;
  std::vector<double> ours_ms, canny_ms;
  for (int round = 0; round < timing::rounds(kRounds); ++round) {
    ours_ms.push_back(milliseconds(
        [&] { edges = node.call(inputs, options.get(), context)[0].as<marrow::EdgeMap>().pixels.size(); }));
    cv::Mat blurred, found;
    canny_ms.push_back(milliseconds([&] {
      cv::GaussianBlur(eight_bits, blurred, {0, 0}, kSigma_px);
      cv::Canny(blurred, found, kLow, kHigh, 3, true);
    }));
    canny_edges = cv::countNonZero(found);
  }
  const double ratio = median(ours_ms) / median(canny_ms);
  std::printf(
      "%-28s %d thread%s: %.1f ms, %zu edges; OpenCV's Canny with blur, 8 bit: %.1f ms, %d edges; ratio %.1f, limit "
      "%.0f\n",
      name.c_str(), threads, threads > 1 ? "s" : "", median(ours_ms), edges, median(canny_ms), canny_edges, ratio,
      kLimit);
  return ratio > kLimit && !timing::is_short();
}

}  // namespace

int main(int count, char** arguments) {
  const std::string name = count > 1 ? arguments[1] : "edges.adaptive_relaxation";
  return timing::exit_code_of([&] { return run(name, 2) | run(name, 1); });
}
