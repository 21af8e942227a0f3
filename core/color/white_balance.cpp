#include "core/color/white_balance.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "core/color/cie_data.h"

namespace core {
namespace {

using Triple = std::array<double, 3>;
using Matrix = std::array<Triple, 3>;  // rows

constexpr Matrix transposed(const Matrix& m) {
  return {{{m[0][0], m[1][0], m[2][0]}, {m[0][1], m[1][1], m[2][1]}, {m[0][2], m[1][2], m[2][2]}}};
}

constexpr Matrix kRgbFromXyz =
    transposed({rgb_from_xyz<Triple>(1.0, 0.0, 0.0), rgb_from_xyz<Triple>(0.0, 1.0, 0.0),
                rgb_from_xyz<Triple>(0.0, 0.0, 1.0)});
constexpr Matrix kBradford = {
    {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};

Triple times(const Matrix& m, const Triple& v) {
  Triple out{};
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  }
  return out;
}

Triple cross(const Triple& a, const Triple& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Rows of the inverse's transpose are the cross products of rows, over the determinant.
Matrix inverse(const Matrix& m) {
  const Matrix columns = {cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])};
  const double determinant =
      m[0][0] * columns[0][0] + m[0][1] * columns[0][1] + m[0][2] * columns[0][2];
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      out[i][k] = columns[k][i] / determinant;
    }
  }
  return out;
}

/// Returns the colour of a black body, with Y = 1.
Triple black_body(double kelvin) {
  constexpr double kSecondRadiationConstant = 1.438776877e-2;  // m K, CODATA 2018
  Triple sum{};
  for (std::size_t i = 0; i < kCieRows.size(); ++i) {
    const double nm =
        static_cast<double>(kCieFirstNm) + static_cast<double>(i) * static_cast<double>(kCieStepNm);
    const double relative =
        std::pow(nm / 560, -5) / std::expm1(kSecondRadiationConstant / (nm * 1e-9 * kelvin));
    const CieRow& row = kCieRows[i];
    sum[0] += relative * static_cast<double>(row.x);
    sum[1] += relative * static_cast<double>(row.y);
    sum[2] += relative * static_cast<double>(row.z);
  }
  return {sum[0] / sum[1], 1, sum[2] / sum[1]};
}

Rgb rounded(const Triple& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

}  // namespace

WhiteBalance::WhiteBalance(float kelvin) {
  const Matrix xyz_from_rgb = inverse(kRgbFromXyz);
  const Triple from = times(kBradford, black_body(static_cast<double>(kelvin)));
  const Triple to = times(kBradford, times(xyz_from_rgb, {1, 1, 1}));
  const auto adapted = [&](const Triple& linear) {
    Triple cone = times(kBradford, times(xyz_from_rgb, linear));
    for (std::size_t i = 0; i < 3; ++i) {
      cone[i] *= to[i] / from[i];
    }
    return rounded(times(kRgbFromXyz, times(inverse(kBradford), cone)));
  };
  red_ = adapted({1, 0, 0});
  green_ = adapted({0, 1, 0});
  blue_ = adapted({0, 0, 1});
}

}  // namespace core
