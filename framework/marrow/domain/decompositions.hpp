// SPDX-License-Identifier: Apache-2.0
#pragma once
// Eigen's decompositions of small matrices. Each takes seconds to compile, so they are compiled once, in marrow's
// library.
#include <Eigen/Core>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Eigenvalues of a symmetric matrix in ascending order, and its unit eigenvectors as columns in the same order.
template <int Size>
struct SymmetricEigen {
  Eigen::Matrix<double, Size, 1> values;
  Eigen::Matrix<double, Size, Size> vectors;
};

/// Decomposes a symmetric matrix. Only its lower triangle is read. Sizes: 2, 3, 6, 8 and Eigen::Dynamic.
template <int Size>
SymmetricEigen<Size> eigen_of_symmetric(const Eigen::Matrix<double, Size, Size>& matrix);

/// Solves matrix * x = right by the LDL^T decomposition. The matrix must be symmetric and semidefinite. Only its lower
/// triangle is read. Sizes: 3, 6 and Eigen::Dynamic.
template <int Size>
Eigen::Matrix<double, Size, 1> solve_symmetric(const Eigen::Matrix<double, Size, Size>& matrix,
                                               const Eigen::Matrix<double, Size, 1>& right);

/// The inverse of a symmetric positive definite matrix by the LDL^T decomposition.
Eigen::Matrix<double, 6, 6> inverse_of_symmetric(const Eigen::Matrix<double, 6, 6>& matrix);

/// The inverse of a matrix by its LU decomposition with partial pivoting. The matrix must be square and regular.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& matrix);

/// The x that makes terms * x nearest to `right`, by a QR decomposition with column pivoting. `terms` has at least as
/// many rows as columns, and `right` has as many rows as `terms`.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& terms, const Eigen::VectorXd& right);
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& terms, const Eigen::MatrixXd& right);

/// The orthogonal matrix that is nearest to `matrix` in the Frobenius norm: U V^T of the singular value decomposition.
/// It is a rotation if the determinant of `matrix` is positive.
Eigen::Matrix3d nearest_orthogonal(const Eigen::Matrix3d& matrix);
/// The rotation that is nearest to `matrix` in the Frobenius norm: U diag(1, 1, +-1) V^T.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

extern template SymmetricEigen<2> eigen_of_symmetric<2>(const Eigen::Matrix<double, 2, 2>&);
extern template SymmetricEigen<3> eigen_of_symmetric<3>(const Eigen::Matrix<double, 3, 3>&);
extern template SymmetricEigen<6> eigen_of_symmetric<6>(const Eigen::Matrix<double, 6, 6>&);
extern template SymmetricEigen<8> eigen_of_symmetric<8>(const Eigen::Matrix<double, 8, 8>&);
extern template SymmetricEigen<Eigen::Dynamic> eigen_of_symmetric<Eigen::Dynamic>(const Eigen::MatrixXd&);
extern template Eigen::Vector3d solve_symmetric<3>(const Eigen::Matrix3d&, const Eigen::Vector3d&);
extern template Eigen::Matrix<double, 6, 1> solve_symmetric<6>(const Eigen::Matrix<double, 6, 6>&,
                                                               const Eigen::Matrix<double, 6, 1>&);
extern template Eigen::VectorXd solve_symmetric<Eigen::Dynamic>(const Eigen::MatrixXd&, const Eigen::VectorXd&);

}  // namespace marrow
