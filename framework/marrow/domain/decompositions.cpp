// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/decompositions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <type_traits>

namespace marrow {

// One solver serves all sizes but 3, for which Eigen has another way: each more takes 8 s to compile. The values are
// the same to the last digit.
template <int Size>
SymmetricEigen<Size> eigen_of_symmetric(const Eigen::Matrix<double, Size, Size>& matrix) {
  const Eigen::SelfAdjointEigenSolver<std::conditional_t<Size == 3, Eigen::Matrix3d, Eigen::MatrixXd>> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

template <int Size>
Eigen::Matrix<double, Size, 1> solve_symmetric(const Eigen::Matrix<double, Size, Size>& matrix,
                                               const Eigen::Matrix<double, Size, 1>& right) {
  return matrix.ldlt().solve(right);
}

Eigen::Matrix<double, 6, 6> inverse_of_symmetric(const Eigen::Matrix<double, 6, 6>& matrix) {
  return matrix.ldlt().solve(Eigen::Matrix<double, 6, 6>::Identity());
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& matrix) { return matrix.inverse(); }

Eigen::VectorXd least_squares(const Eigen::MatrixXd& terms, const Eigen::VectorXd& right) {
  return terms.colPivHouseholderQr().solve(right);
}

Eigen::MatrixXd least_squares(const Eigen::MatrixXd& terms, const Eigen::MatrixXd& right) {
  return terms.colPivHouseholderQr().solve(right);
}

Eigen::Matrix3d nearest_orthogonal(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d orthogonal = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Vector3d signs(1, 1, orthogonal.determinant() < 0 ? -1 : 1);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

template MARROW_EXPORT_INSTANCE SymmetricEigen<2> eigen_of_symmetric<2>(const Eigen::Matrix<double, 2, 2>&);
template MARROW_EXPORT_INSTANCE SymmetricEigen<3> eigen_of_symmetric<3>(const Eigen::Matrix<double, 3, 3>&);
template MARROW_EXPORT_INSTANCE SymmetricEigen<6> eigen_of_symmetric<6>(const Eigen::Matrix<double, 6, 6>&);
template MARROW_EXPORT_INSTANCE SymmetricEigen<8> eigen_of_symmetric<8>(const Eigen::Matrix<double, 8, 8>&);
template MARROW_EXPORT_INSTANCE SymmetricEigen<Eigen::Dynamic> eigen_of_symmetric<Eigen::Dynamic>(
    const Eigen::MatrixXd&);
template MARROW_EXPORT_INSTANCE Eigen::Vector3d solve_symmetric<3>(const Eigen::Matrix3d&, const Eigen::Vector3d&);
template MARROW_EXPORT_INSTANCE Eigen::Matrix<double, 6, 1> solve_symmetric<6>(const Eigen::Matrix<double, 6, 6>&,
                                                                               const Eigen::Matrix<double, 6, 1>&);
template MARROW_EXPORT_INSTANCE Eigen::VectorXd solve_symmetric<Eigen::Dynamic>(const Eigen::MatrixXd&,
                                                                                const Eigen::VectorXd&);

}  // namespace marrow
