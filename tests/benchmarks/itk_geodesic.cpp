// SPDX-License-Identifier: Apache-2.0
#include "itk_geodesic.hpp"

#include <itkFastMarchingImageFilter.h>
#include <itkGeodesicActiveContourLevelSetImageFilter.h>
#include <itkGradientMagnitudeRecursiveGaussianImageFilter.h>
#include <itkImage.h>
#include <itkMultiThreaderBase.h>
#include <itkSigmoidImageFilter.h>
#include <itkVersion.h>

#include <algorithm>
#include <chrono>

namespace itk_peer {
namespace {

using Image = itk::Image<float, 3>;

Image::Pointer image_of(const std::vector<float>& values, const std::array<int, 3>& size,
                        const std::array<double, 3>& spacing_mm) {
  auto image = Image::New();
  image->SetRegions(
      Image::SizeType{{itk::SizeValueType(size[0]), itk::SizeValueType(size[1]), itk::SizeValueType(size[2])}});
  image->SetSpacing(spacing_mm.data());
  image->Allocate();
  std::copy(values.begin(), values.end(), image->GetBufferPointer());
  return image;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Image::Pointer speed_image(const Image::Pointer& ct, const Settings& settings) {
  using Gradient = itk::GradientMagnitudeRecursiveGaussianImageFilter<Image, Image>;
  const auto gradient = Gradient::New();
  gradient->SetInput(ct);
  gradient->SetSigma(settings.gradient_sigma_mm);
  using Sigmoid = itk::SigmoidImageFilter<Image, Image>;
  const auto sigmoid = Sigmoid::New();
  sigmoid->SetInput(gradient->GetOutput());
  sigmoid->SetAlpha(-settings.sigmoid_width_hu_per_mm);
  sigmoid->SetBeta(settings.sigmoid_middle_hu_per_mm);
  sigmoid->SetOutputMinimum(0);
  sigmoid->SetOutputMaximum(1);
  sigmoid->Update();
  return sigmoid->GetOutput();
}

Result contour(const Image::Pointer& ct, const Image::Pointer& speed, const std::vector<std::array<int, 3>>& seeds,
               const Settings& settings) {
  using March = itk::FastMarchingImageFilter<Image, Image>;
  const auto march = March::New();
  const auto points = March::NodeContainer::New();
  for (const auto& seed : seeds) {
    March::NodeType node;
    node.SetValue(-settings.start_radius_mm);
    node.SetIndex(Image::IndexType{{seed[0], seed[1], seed[2]}});
    points->push_back(node);
  }
  march->SetTrialPoints(points);
  march->SetSpeedConstant(1);
  march->SetOutputRegion(ct->GetBufferedRegion());
  march->SetOutputSpacing(ct->GetSpacing());
  march->SetOutputOrigin(ct->GetOrigin());
  using Geodesic = itk::GeodesicActiveContourLevelSetImageFilter<Image, Image>;
  const auto geodesic = Geodesic::New();
  geodesic->SetInput(march->GetOutput());
  geodesic->SetFeatureImage(speed);
  geodesic->SetPropagationScaling(settings.propagation);
  geodesic->SetCurvatureScaling(settings.curvature);
  geodesic->SetAdvectionScaling(settings.advection);
  geodesic->SetMaximumRMSError(settings.least_rms);
  geodesic->SetNumberOfIterations(unsigned(settings.most_iterations));
  geodesic->Update();
  Result result;
  const Image::Pointer field = geodesic->GetOutput();
  result.field.assign(field->GetBufferPointer(),
                      field->GetBufferPointer() + field->GetBufferedRegion().GetNumberOfPixels());
  result.iterations = int(geodesic->GetElapsedIterations());
  return result;
}

}  // namespace

std::string version() { return itk::Version::GetITKVersion(); }

std::vector<Result> geodesic_active_contours(const std::vector<float>& hu, const std::array<int, 3>& size,
                                             const std::array<double, 3>& spacing_mm,
                                             const std::vector<std::vector<std::array<int, 3>>>& seeds,
                                             const Settings& settings) {
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(settings.threads);
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(settings.threads);
  const auto ct = image_of(hu, size, spacing_mm);
  auto start = std::chrono::steady_clock::now();
  const auto speed = speed_image(ct, settings);
  const double speed_image_s = seconds_since(start);
  std::vector<Result> results;
  for (const auto& points : seeds) {
    start = std::chrono::steady_clock::now();
    Result& result = results.emplace_back(contour(ct, speed, points, settings));
    result.contour_s = seconds_since(start);
    result.speed_image_s = speed_image_s;
  }
  return results;
}

}  // namespace itk_peer
