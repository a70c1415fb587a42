// SPDX-License-Identifier: Apache-2.0
// Images as a C-arm exports them: with lag, behind a collimator, saturated, of 8 bits with gamma and local contrast.
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/simulate/collimator.hpp"

namespace {

using namespace marrow;

struct ExportOptions {
  std::string lag = "off";
  std::string collimator = "off";
  std::string saturation = "off";
  std::string eight_bit = "off";
  int collimator_seed = 1;
};

// The figures of the levels mild, usual and bad (docs/simulation.md).
constexpr std::array<double, 3> kLag{0.05, 0.15, 0.35};
constexpr std::array<double, 3> kWhite{50000, 30000, 16000};  // soft tissue alone is 12000
constexpr std::array<double, 3> kBlack{0, 1500, 3500};
constexpr std::array<double, 3> kGamma{0.8, 0.6, 0.45};
constexpr std::array<double, 3> kClipLimit{0, 1.5, 3};  // 0: no local contrast
constexpr int kTiles = 8;
constexpr double kBehindBlade = 0.02;  // leakage and scatter
constexpr double kWholeRange = 65535;

int level_of(const std::string& name) { return name == "off" ? -1 : name == "mild" ? 0 : name == "usual" ? 1 : 2; }

View exported(const View& view, const View* earlier, const ExportOptions& options, std::size_t number) {
  const int lag = level_of(options.lag), saturation = level_of(options.saturation),
            eight_bit = level_of(options.eight_bit);
  View result = view;
  if (!(lag >= 0 && earlier) && options.collimator == "off" && saturation < 0 && eight_bit < 0) return result;
  cv::Mat1d grey;
  view.image.pixels.convertTo(grey, CV_64F);
  if (lag >= 0 && earlier) {
    const double share = kLag[std::size_t(lag)];
    cv::Mat1d before;
    earlier->image.pixels.convertTo(before, CV_64F);
    grey = (1 - share) * grey + share * before;
  }
  const cv::Mat1d passed =
      phantom::passed_by_collimator(grey.size(), options.collimator, std::uint64_t(options.collimator_seed), number);
  if (!passed.empty()) grey = grey.mul(kBehindBlade + (1 - kBehindBlade) * passed);
  double black = 0, white = kWholeRange;
  if (saturation >= 0) {
    black = kBlack[std::size_t(saturation)];
    white = kWhite[std::size_t(saturation)];
    for (double& value : grey) value = std::clamp(value, black, white);
  }
  if (eight_bit < 0) {
    cv::Mat pixels;
    grey.convertTo(pixels, CV_16U);
    result.image.pixels = pixels;
    return result;
  }
  const double gamma = kGamma[std::size_t(eight_bit)];
  for (double& value : grey) value = 255 * std::pow((value - black) / (white - black), gamma);
  cv::Mat pixels;
  grey.convertTo(pixels, CV_8U);
  if (const double limit = kClipLimit[std::size_t(eight_bit)]; limit > 0)
    cv::createCLAHE(limit, {kTiles, kTiles})->apply(pixels, pixels);
  result.image.pixels = pixels;
  return result;
}

List<View> export_views(const List<View>& views, const List<View>* earlier, const ExportOptions& options) {
  List<View> results;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string& name = views.name(i);
    check_view(views[i]);
    if (views[i].image.pixels.type() != CV_16U)
      throw Error("simulate.export: view '" + name + "' is not of 16 bits; give it the views of simulate.fluoroscopy");
    const View* before = earlier ? earlier->find(name) : nullptr;
    if (earlier && !before)
      throw Error("simulate.export: there is no earlier image of view '" + name +
                  "'; give 'earlier_views' the same views");
    if (before && before->image.pixels.size() != views[i].image.pixels.size())
      throw Error("simulate.export: the earlier image of view '" + name + "' has another size");
    results.add(name, exported(views[i], before, options, i));
  }
  return results;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("simulate.export", export_views);
  node.summary("Images as a C-arm exports them: lag, collimator, saturation, and 8 bits with gamma and local contrast")
      .in("views", "X-ray images of 16 bits", over("view"))
      .in("earlier_views", "images of an earlier moment, for the lag", over("view"))
      .out("views", "the same images, of 8 bits if eight_bit is not off", over("view"));
  const auto level = [&](const char* name, std::string ExportOptions::*member, const char* help) {
    node.option(name, member, help, one_of({"off", "mild", "usual", "bad"}));
  };
  level("lag", &ExportOptions::lag, "share of the earlier image in this one: 5, 15 or 35 %");
  level("collimator", &ExportOptions::collimator,
        "each blade covers up to 3, 8 or 16 % of the image; bad: an iris too");
  level("saturation", &ExportOptions::saturation,
        "white from 4.2, 2.5 or 1.3 times the grey value of soft tissue on; black up to 0, 12 or 29 % of it");
  level("eight_bit", &ExportOptions::eight_bit,
        "8 bits with a gamma of 0.8, 0.6 or 0.45, and local contrast (CLAHE) with a limit of 1.5 (usual) or 3 (bad)");
  node.option("collimator_seed", &ExportOptions::collimator_seed, "seed of the blades' places", at_least(0));
}
