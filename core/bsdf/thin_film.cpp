#include "core/bsdf/thin_film.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "core/bsdf/fresnel.h"
#include "core/math/lane_math.h"
#include "core/math/numbers.h"

namespace core {
namespace {

float f0_of(float n_transmitted, float n_incident) {
  return square((n_transmitted - n_incident) / (n_transmitted + n_incident));
}

float schlick(float f0, float cos_i) { return f0 + (1 - f0) * schlick_weight(cos_i); }

/// The Fourier-transformed colour matching functions of the first two orders of reflection at once:
/// per order two Gaussians of X, and those of Y and Z.
class Orders {
 public:
  /// path_nm, shift: optical path difference and phase of the first order; that of the m-th has m
  /// times as much.
  Orders(float path_nm, Rgb shift) {
    const Floats<8> order = load<8>(kOrder);
    const Floats<8> phase = Floats<8>(kTwoPi * path_nm * 1e-9F) * order;
    alignas(Floats<8>) const float shifts[8] = {shift.r, shift.r, shift.g, shift.b,
                                                shift.r, shift.r, shift.g, shift.b};
    const Floats<8> angle = load<8>(kPosition) * phase + load<8>(shifts) * order;
    Floats<8> sine;
    Floats<8> cosine;
    sincos(angle - Floats<8>(kTwoPi) * to_floats(floor_of(angle * Floats<8>(1 / kTwoPi))), sine,
           cosine);
    store(values_, load<8>(kHeight) * cosine * exp(load<8>(kVariance) * phase * (-phase)));
  }
  /// Linear Rec.709 of order 1 or 2.
  Rgb rgb(int order) const noexcept {
    const float* const of = values_ + 4 * (order - 1);
    const float x = of[0] + of[1];
    const float y = of[2];
    const float z = of[3];
    const float k = 1 / 1.0685e-7F;
    return rgb_from_xyz(x, y, z) * k;
  }

 private:
  alignas(Floats<8>) static constexpr float kOrder[8] = {1, 1, 1, 1, 2, 2, 2, 2};
  alignas(Floats<8>) static constexpr float kPosition[8] = {1.6810e+06F, 2.2399e+06F, 1.7953e+06F,
                                                            2.2084e+06F, 1.6810e+06F, 2.2399e+06F,
                                                            1.7953e+06F, 2.2084e+06F};
  alignas(Floats<8>) static constexpr float kVariance[8] = {4.3278e+09F, 4.5282e+09F, 9.3046e+09F,
                                                            6.6121e+09F, 4.3278e+09F, 4.5282e+09F,
                                                            9.3046e+09F, 6.6121e+09F};
  /// 5.4856e-13, 9.7470e-14, 4.4201e-13 and 5.2481e-13, times the root of 2 pi times the variance.
  alignas(Floats<8>) static constexpr float kHeight[8] = {
      9.04581417e-08F, 1.64408286e-08F, 1.06873709e-07F, 1.06969938e-07F,
      9.04581417e-08F, 1.64408286e-08F, 1.06873709e-07F, 1.06969938e-07F};
  float values_[8];
};

/// Returns the sum of a^m cos(m phase) over m >= 1.
float all_orders(float a, float phase) {
  const float real = a * std::cos(phase);
  return (real - a * a) / (1 - 2 * real + a * a);
}

}  // namespace

Rgb thin_film_fresnel(float cos_outer, float film_ior, float thickness_nm, Rgb base_f0,
                      Rgb wavelengths_nm) noexcept {
  // As the thickness of a film tends to 0, its index tends to that of air.
  const float t = clamp01(thickness_nm / 30.0F);
  const float n1 = 1 + (film_ior - 1) * (t * t * (3 - 2 * t));
  const float sin2 = (1 - cos_outer * cos_outer) / (n1 * n1);
  if (sin2 >= 1) {
    return Rgb(1);
  }
  const float cos_film = std::sqrt(1 - sin2);
  const float r12 = schlick(f0_of(n1, 1), cos_outer);
  const float t121 = 1 - r12;
  const float phi12 = n1 < 1 ? kPi : 0.0F;
  const float phi21 = kPi - phi12;
  const float path_nm = 2 * n1 * thickness_nm * cos_film;
  Rgb r23;
  Rgb phi;
  const auto base = [&](float f0, float& r, float& p) {
    const float root = std::sqrt(std::min(f0, 0.9999F));
    const float n_base = (1 + root) / (1 - root);
    r = schlick(f0_of(n_base, n1), cos_film);
    p = phi21 + (n_base < n1 ? kPi : 0.0F);
  };
  base(base_f0.r, r23.r, phi.r);
  base(base_f0.g, r23.g, phi.g);
  base(base_f0.b, r23.b, phi.b);
  const auto clamped = [](float v) { return std::clamp(v, 0.0F, 0.9999F); };
  const Rgb r123 = {clamped(r12 * r23.r), clamped(r12 * r23.g), clamped(r12 * r23.b)};
  const Rgb root = {std::sqrt(r123.r), std::sqrt(r123.g), std::sqrt(r123.b)};
  const auto series = [&](float r, float all) { return t121 * t121 * r / (1 - all); };
  const Rgb rs = {series(r23.r, r123.r), series(r23.g, r123.g), series(r23.b, r123.b)};
  Rgb sum = Rgb(r12) + rs;
  Rgb c = rs - Rgb(t121);
  if (wavelengths_nm.r > 0) {
    const auto at = [&](int i) {
      return sum[i] + 2 * c[i] * all_orders(root[i], kTwoPi * path_nm / wavelengths_nm[i] + phi[i]);
    };
    return {clamp01(at(0)), clamp01(at(1)), clamp01(at(2))};
  }
  const Orders orders(path_nm, phi);
  for (int m = 1; m <= 2; ++m) {
    c *= root;
    sum += c * orders.rgb(m) * 2.0F;
  }
  return {clamp01(sum.r), clamp01(sum.g), clamp01(sum.b)};
}

double airy_reflectance(double cos_outer, double n0, double n1, double n2, double thickness_nm,
                        double wavelength_nm) noexcept {
  using Complex = std::complex<double>;
  const double s = n0 * std::sqrt(1 - cos_outer * cos_outer);
  const Complex c0 = cos_outer;
  const Complex c1 = std::sqrt(Complex(1 - s * s / (n1 * n1)));
  const Complex c2 = std::sqrt(Complex(1 - s * s / (n2 * n2)));
  const Complex turn =
      std::exp(Complex(0, 4 * 3.14159265358979323846 * n1 * thickness_nm / wavelength_nm) * c1);
  double sum = 0;
  for (const bool s_polarised : {true, false}) {
    const auto r = [s_polarised](double na, Complex ca, double nb, Complex cb) {
      return s_polarised ? (na * ca - nb * cb) / (na * ca + nb * cb)
                         : (nb * ca - na * cb) / (nb * ca + na * cb);
    };
    const Complex r01 = r(n0, c0, n1, c1);
    const Complex r12 = r(n1, c1, n2, c2);
    sum += std::norm((r01 + r12 * turn) / (1.0 + r01 * r12 * turn));
  }
  return sum / 2;
}

}  // namespace core
