// SPDX-License-Identifier: Apache-2.0
#include "itk_contour.hpp"

#include <itkGeodesicActiveContourLevelSetImageFilter.h>
#include <itkGradientMagnitudeRecursiveGaussianImageFilter.h>
#include <itkImage.h>

#include <algorithm>

namespace marrow::segment {
namespace {

using Image = itk::Image<float, 3>;

Image::Pointer image_of(const std::vector<float>& values, const std::array<int, 3>& size,
                        const std::array<double, 3>& spacing_mm) {
  const auto image = Image::New();
  image->SetRegions(
      Image::SizeType{{itk::SizeValueType(size[0]), itk::SizeValueType(size[1]), itk::SizeValueType(size[2])}});
  image->SetSpacing(spacing_mm.data());
  image->Allocate();
  std::copy(values.begin(), values.end(), image->GetBufferPointer());
  return image;
}

}  // namespace

Contour geodesic(const std::vector<float>& hu, std::vector<float> start, const std::array<int, 3>& size,
                 const std::array<double, 3>& spacing_mm, const Settings& settings) {
  using Gradient = itk::GradientMagnitudeRecursiveGaussianImageFilter<Image, Image>;
  const auto gradient = Gradient::New();
  gradient->SetInput(image_of(hu, size, spacing_mm));
  gradient->SetSigma(settings.sigma_mm);
  gradient->Update();
  const Image::Pointer speed = gradient->GetOutput();
  for (std::size_t i = 0; i < hu.size(); ++i) {
    float& value = speed->GetBufferPointer()[i];
    value = float(1 / (1 + std::pow(value / settings.edge_hu_per_mm, 2)));
  }
  using Geodesic = itk::GeodesicActiveContourLevelSetImageFilter<Image, Image>;
  const auto geodesic = Geodesic::New();
  geodesic->SetInput(image_of(start, size, spacing_mm));
  geodesic->SetFeatureImage(speed);
  geodesic->SetPropagationScaling(settings.propagation);
  geodesic->SetCurvatureScaling(settings.curvature);
  geodesic->SetAdvectionScaling(settings.advection);
  geodesic->SetMaximumRMSError(settings.min_rms);
  geodesic->SetNumberOfIterations(unsigned(settings.iterations));
  geodesic->Update();
  Contour contour;
  std::copy_n(geodesic->GetOutput()->GetBufferPointer(), start.size(), start.begin());
  contour.values = std::move(start);
  contour.iterations = int(geodesic->GetElapsedIterations());
  contour.rms = geodesic->GetRMSChange();
  return contour;
}

}  // namespace marrow::segment
