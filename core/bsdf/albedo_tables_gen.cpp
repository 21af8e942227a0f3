// Writes the directional-albedo tables as C++ source. Runs at build time, so that start-up and the
// first image do not wait for it.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <type_traits>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/anisotropic_albedo.h"
#include "core/bsdf/fresnel.h"
#include "core/bsdf/ggx.h"
#include "core/bsdf/sheen.h"

namespace {

using core::Ggx;
using core::Vec2;
using core::Vec3;

constexpr int kSide = 64;  // points: a kSide x kSide midpoint grid over the visible normals

Vec3 direction(float mu) { return {core::safe_sqrt(1 - mu * mu), 0, mu}; }

float mu_of(int node, int nodes) {
  const float t = static_cast<float>(node) / static_cast<float>(nodes - 1);
  return std::max(t * t, 1e-4F);
}

float alpha_of(int node, int nodes) {
  const float r = static_cast<float>(node) / static_cast<float>(nodes - 1);
  return std::max(r * r, 1e-4F);
}

/// Visits visible normals h with their weight in a mean. Narrow lobes lose light where 1 - u.y is
/// of the order of alpha^2; with u.y = 1 - t^2 the midpoints are densest there.
template <int kPoints = kSide, typename Visit>
void for_normals(const Ggx& ggx, Vec3 wo, Visit&& visit) {
  for (int b = 0; b < kPoints; ++b) {
    const float t = (static_cast<float>(b) + 0.5F) / kPoints;
    for (int a = 0; a < kPoints; ++a) {
      const Vec2 u = {(static_cast<float>(a) + 0.5F) / kPoints, 1 - t * t};
      visit(ggx.sample_visible(wo, u), static_cast<double>(2 * t) / (kPoints * kPoints));
    }
  }
}

/// 2 * integral over mu of e(mu) mu, mu = t^2: 4 * integral over t of e t^3; interpolants are
/// linear in t, so a fine midpoint rule is exact to rounding. value_at(n, f): e at share f between
/// nodes n and n + 1 of kNodes.
template <std::size_t kNodes, typename ValueAt>
float mean_over_mu(ValueAt&& value_at) {
  constexpr int kFine = 4096;
  double sum = 0;
  for (int k = 0; k < kFine; ++k) {
    const double x = (k + 0.5) / kFine;
    const double at = x * static_cast<double>(kNodes - 1);
    const auto n = static_cast<std::size_t>(at);
    sum += x * x * x * value_at(n, at - static_cast<double>(n));
  }
  return static_cast<float>(4 * sum / kFine);
}

double between(float low, float high, double f) {
  return static_cast<double>(low) * (1 - f) + static_cast<double>(high) * f;
}

template <std::size_t N>
float average_of(const float (&e)[N]) {
  return mean_over_mu<N>([&](std::size_t n, double f) { return between(e[n], e[n + 1], f); });
}

core::SpecularAlbedo reflected(const Ggx& ggx, Vec3 wo) {
  double e = 0;
  double e5 = 0;
  for_normals(ggx, wo, [&](Vec3 h, double weight) {
    const Vec3 wi = h * (2 * dot(wo, h)) - wo;
    if (wi.z > 0) {
      // f cos / pdf with F = 1 is G2 / G1.
      const double value = weight * static_cast<double>(ggx.g2(wo, wi) / ggx.g1(wo));
      e += value;
      e5 += value * static_cast<double>(core::schlick_weight(dot(wo, h)));
    }
  });
  return {static_cast<float>(e), static_cast<float>(e5)};
}

/// The mean over the hemisphere: over phi by the midpoint rule, over mu as average_of().
core::SpecularAlbedo mean_over_hemisphere(const Ggx& ggx) {
  constexpr int kPhi = 8;  // of a quarter turn
  constexpr int kMu = 16;
  double e = 0;
  double e5 = 0;
  for (int a = 0; a < kPhi; ++a) {
    const float phi = 0.5F * core::kPi * (static_cast<float>(a) + 0.5F) / kPhi;
    for (int i = 0; i < kMu; ++i) {
      const float t = (static_cast<float>(i) + 0.5F) / kMu;
      const float sine = core::safe_sqrt(1 - t * t * t * t);
      const auto at = reflected(ggx, {sine * std::cos(phi), sine * std::sin(phi), t * t});
      const double weight = static_cast<double>(4 * t * t * t) / (kPhi * kMu);
      e += weight * static_cast<double>(at.e);
      e5 += weight * static_cast<double>(at.e5);
    }
  }
  return {static_cast<float>(e), static_cast<float>(e5)};
}

void fill_reflection(core::AlbedoTables& t) {
  for (int j = 0; j < core::kAlbedoNodes; ++j) {
    const float alpha = alpha_of(j, core::kAlbedoNodes);
    const Ggx ggx = {alpha, alpha};
    float e[core::kAlbedoNodes];
    float e5[core::kAlbedoNodes];
    for (int i = 0; i < core::kAlbedoNodes; ++i) {
      t.single[j][i] = reflected(ggx, direction(mu_of(i, core::kAlbedoNodes)));
      e[i] = t.single[j][i].e;
      e5[i] = t.single[j][i].e5;
    }
    t.average[j] = {average_of(e), average_of(e5)};
  }
}

/// Pre: fill_reflection() ran.
void fill_under_coat(core::AlbedoTables& t) {
  for (int j = 0; j < core::kAlbedoNodes; ++j) {
    float coat[core::kAlbedoNodes];
    for (int i = 0; i < core::kAlbedoNodes; ++i) {
      coat[i] = core::coat_albedo(t.single[j][i]);
    }
    for (int k = 0; k < core::kAlbedoNodes; ++k) {
      const auto covariance = [&](float core::SpecularAlbedo::*part) {
        const auto mean = static_cast<double>(t.average[k].*part);
        return mean_over_mu<core::kAlbedoNodes>([&](std::size_t n, double f) {
          const double e = between(t.single[k][n].*part, t.single[k][n + 1].*part, f);
          return between(coat[n], coat[n + 1], f) * (e - mean);
        });
      };
      t.under_coat[j][k] = {covariance(&core::SpecularAlbedo::e),
                            covariance(&core::SpecularAlbedo::e5)};
    }
  }
}

constexpr int kG = core::kGlassNodes;

/// kOpen: facets reflect nothing but by total reflection.
template <int kPoints = kSide, bool kOpen = false>
float glass(const Ggx& ggx, Vec3 wo, float eta) {
  double sum = 0;
  for_normals<kPoints>(ggx, wo, [&](Vec3 h, double weight) {
    const float cos_o = dot(wo, h);
    const float exact = core::fresnel_dielectric(cos_o, eta);
    const float fresnel = kOpen && exact < 1 ? 0.0F : exact;
    const Vec3 reflected = h * (2 * cos_o) - wo;
    if (reflected.z > 0) {
      sum += weight * static_cast<double>(fresnel * ggx.g2(wo, reflected) / ggx.g1(wo));
    }
    if (fresnel < 1) {
      const float cos_t = core::safe_sqrt(1 - (1 - cos_o * cos_o) / (eta * eta));
      const Vec3 refracted = h * (cos_o / eta - cos_t) - wo * (1 / eta);
      if (refracted.z < 0) {
        const Vec3 flipped = {refracted.x, refracted.y, -refracted.z};
        sum += weight * static_cast<double>((1 - fresnel) * ggx.g2(wo, flipped) / ggx.g1(wo));
      }
    }
  });
  return static_cast<float>(sum);
}

template <bool kOpen>
void fill(core::GlassTable& t) {
  for (int k = 0; k < kG; ++k) {
    const float x = static_cast<float>(k) / (kG - 1);
    const float ior = 1 + 2 * x * x;
    for (int j = 0; j < kG; ++j) {
      const float alpha = alpha_of(j, kG);
      for (int i = 0; i < kG; ++i) {
        const Vec3 wo = direction(mu_of(i, kG));
        t.at[0][k][j][i] = glass<kSide, kOpen>({alpha, alpha}, wo, ior);
        t.at[1][k][j][i] = glass<kSide, kOpen>({alpha, alpha}, wo, 1 / ior);
      }
      t.average[0][k][j] = average_of(t.at[0][k][j]);
      t.average[1][k][j] = average_of(t.at[1][k][j]);
    }
  }
}

void fill_glass(core::AlbedoTables& t) {
  fill<false>(t.glass);
  fill<true>(t.open_glass);
}

void fill_sheen(core::AlbedoTables& t) {
  constexpr int kTheta = 256;
  constexpr int kPhi = 128;
  for (int j = 0; j < core::kSheenNodes; ++j) {
    const float roughness = static_cast<float>(j) / (core::kSheenNodes - 1);
    for (int i = 0; i < core::kSheenNodes; ++i) {
      const Vec3 wo = direction(std::max(static_cast<float>(i) / (core::kSheenNodes - 1), 2e-3F));
      double sum = 0;
      for (int a = 0; a < kTheta; ++a) {
        const float z = (static_cast<float>(a) + 0.5F) / kTheta;
        const float r = core::safe_sqrt(1 - z * z);
        for (int b = 0; b < kPhi; ++b) {  // half a turn: f is symmetric
          const float phi = core::kPi * (static_cast<float>(b) + 0.5F) / kPhi;
          sum += static_cast<double>(
              z * core::sheen_brdf(wo, {r * std::cos(phi), r * std::sin(phi), z}, roughness));
        }
      }
      t.sheen[j][i] = std::min(static_cast<float>(sum * 6.283185307179586 / (kTheta * kPhi)), 1.0F);
    }
  }
}

Ggx brushed(float narrow, int strength_node, int nodes) {
  const float strength = static_cast<float>(strength_node) / static_cast<float>(nodes - 1);
  return {core::lerp(narrow, 1.0F, strength * strength), narrow};
}

Vec3 direction(int phi, int phi_nodes, int mu_node, int mu_nodes) {
  const float u = static_cast<float>(phi) / static_cast<float>(phi_nodes - 1);
  const float mu = mu_of(mu_node, mu_nodes);
  const float sine = core::safe_sqrt(1 - mu * mu);
  return {sine * u * u, sine * core::safe_sqrt(1 - u * u * u * u), mu};
}

void fill_anisotropic(core::AnisotropicAlbedoTables& t) {
  constexpr auto& kNodes = core::kAnisotropicNodes;
  for (int r = 0; r < kNodes[0]; ++r) {
    const float narrow = alpha_of(r, kNodes[0]);
    for (int s = 0; s < kNodes[1]; ++s) {
      const Ggx ggx = brushed(narrow, s, kNodes[1]);
      for (int p = 0; p < kNodes[2]; ++p) {
        for (int m = 0; m < kNodes[3]; ++m) {
          t.at[r][s][p][m] = reflected(ggx, direction(p, kNodes[2], m, kNodes[3]));
        }
      }
      t.average[r][s] = mean_over_hemisphere(ggx);
    }
  }
}

/// The mean over the hemisphere of the bilinear interpolant in u and t.
template <std::size_t kPhi, std::size_t kMu>
float mean_over_hemisphere(const float (&at)[kPhi][kMu]) {
  constexpr int kFine = 64;
  constexpr int kNodes[] = {static_cast<int>(kPhi), static_cast<int>(kMu)};
  double sum = 0;
  for (int a = 0; a < kFine; ++a) {
    const float phi = 0.5F * core::kPi * (static_cast<float>(a) + 0.5F) / kFine;
    for (int i = 0; i < kFine; ++i) {
      const float t = (static_cast<float>(i) + 0.5F) / kFine;
      const core::albedo_detail::Between<float> place[] = {{std::sqrt(std::cos(phi)), kNodes[0]},
                                                           {t, kNodes[1]}};
      sum += static_cast<double>(4 * t * t * t *
                                 core::albedo_detail::value_at(&at[0][0], place, kNodes, 0));
    }
  }
  return static_cast<float>(sum / (kFine * kFine));
}

/// Pre: kAlbedoTables is filled.
void fill_anisotropic_glass(core::AnisotropicAlbedoTables& t) {
  constexpr auto& kNodes = core::kAnisotropicGlassNodes;
  constexpr int kPoints = 24;  // a mean over 3,000 places and its error are as with 48
  for (int inside = 0; inside < kNodes[0]; ++inside) {
    for (int k = 0; k < kNodes[1]; ++k) {
      const float x = static_cast<float>(k) / static_cast<float>(kNodes[1] - 1);
      const float ior = 1 + 2 * x * x;
      for (int r = 0; r < kNodes[2]; ++r) {
        for (int s = 0; s < kNodes[3]; ++s) {
          const Ggx ggx = brushed(alpha_of(r, kNodes[2]), s, kNodes[3]);
          const float round = core::mean_roughness(ggx.alpha_x, ggx.alpha_y);
          auto& plane = t.glass[inside][k][r][s];
          for (int p = 0; p < kNodes[4]; ++p) {
            for (int m = 0; m < kNodes[5]; ++m) {
              const Vec3 wo = direction(p, kNodes[4], m, kNodes[5]);
              plane[p][m] = glass<kPoints>(ggx, wo, inside != 0 ? 1 / ior : ior) -
                            core::glass_albedo(wo.z, round, ior, inside != 0);
            }
          }
          t.glass_average[inside][k][r][s] = mean_over_hemisphere(plane);
        }
      }
    }
  }
}

/// Writes the initializer of a number, of a pair or of an array of them.
template <typename T>
void write(std::ostream& out, const T& value) {
  if constexpr (std::is_same_v<T, float>) {
    char text[40];
    std::snprintf(text, sizeof(text), "%.9eF,", static_cast<double>(value));
    out << text;
  } else if constexpr (std::is_same_v<T, core::SpecularAlbedo>) {
    out << "{";
    write(out, value.e);
    write(out, value.e5);
    out << "},";
  } else {
    out << "{";
    for (const auto& element : value) {
      write(out, element);
    }
    out << "},\n";
  }
}

template <typename Tables, typename... Fill>
Tables filled(Fill... fill) {
  Tables tables;
  (fill(tables), ...);
  return tables;
}

}  // namespace

namespace core {
// In this order: the second is filled with values of the first.
const AlbedoTables kAlbedoTables =
    filled<AlbedoTables>(fill_reflection, fill_under_coat, fill_glass, fill_sheen);
const AnisotropicAlbedoTables kAnisotropicAlbedoTables =
    filled<AnisotropicAlbedoTables>(fill_anisotropic, fill_anisotropic_glass);
}  // namespace core

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: albedo_tables_gen FILE\n");
    return 2;
  }
  std::ofstream out(argv[1]);
  out << "#include \"core/bsdf/anisotropic_albedo.h\"\nnamespace core {\n";
  out << "extern const AlbedoTables kAlbedoTables;\nconst AlbedoTables kAlbedoTables = {\n";
  write(out, core::kAlbedoTables.single);
  write(out, core::kAlbedoTables.average);
  write(out, core::kAlbedoTables.under_coat);
  for (const core::GlassTable* table :
       {&core::kAlbedoTables.glass, &core::kAlbedoTables.open_glass}) {
    out << "{";
    write(out, table->at);
    write(out, table->average);
    out << "},\n";
  }
  write(out, core::kAlbedoTables.sheen);
  out << "};\nextern const AnisotropicAlbedoTables kAnisotropicAlbedoTables;\n"
      << "const AnisotropicAlbedoTables kAnisotropicAlbedoTables = {\n";
  write(out, core::kAnisotropicAlbedoTables.at);
  write(out, core::kAnisotropicAlbedoTables.average);
  write(out, core::kAnisotropicAlbedoTables.glass);
  write(out, core::kAnisotropicAlbedoTables.glass_average);
  out << "};\n}  // namespace core\n";
  return out.good() ? 0 : 1;
}
