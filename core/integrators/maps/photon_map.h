/// PhotonGrid: stores photons on surfaces and finds those near a point.
///
/// A hashed grid: the photons of a bucket are contiguous, in insertion order. Source: Jensen 2001,
/// "Realistic Image Synthesis Using Photon Mapping"; the hashed grid: PBR 4th ed., section 13.4
/// (online).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/color/rgb.h"
#include "core/integrators/maps/photon_rules.h"
#include "core/math/vec.h"

namespace core {

/// A unit vector in four bytes: octahedral encoding, accurate to 1e-4 rad. Source: Cigolle and
/// others 2014, "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2).
class PackedDirection {
 public:
  PackedDirection() = default;
  explicit PackedDirection(Vec3 unit) noexcept;
  Vec3 unpacked() const noexcept;

 private:
  std::int16_t x_ = 0;
  std::int16_t y_ = 0;
};

/// Returns whether a particle at a surface of one normal counts at a nearby point of the other:
/// those turned by more than 45 degrees are other surfaces, as beyond the edge of a box.
inline bool faces_alike(Vec3 normal, Vec3 other) noexcept {
  constexpr float kCosTurned = 0.7071068F;
  return std::fabs(dot(normal, other)) >= kCosTurned;
}

/// A particle on a surface.
struct Photon {
  Vec3 position;                  ///< world [m]
  Rgb power;                      ///< as if it were the only photon [W]
  PackedDirection wi_world;       ///< direction it came from, away from the surface
  PackedDirection normal;         ///< geometric
  std::uint16_t scatterings = 0;  ///< before this surface
  bool is_caustic = false;        ///< scattered at least once, and only at smooth surfaces
};

static_assert(sizeof(Photon) == kPhotonBytes);

/// P: has a `position` (world, m).
template <typename P>
class PhotonGrid {
 public:
  /// Empties `parts`. radius_m > 0: search radius of each().
  PhotonGrid(std::vector<std::vector<P>>& parts, float radius_m);
  PhotonGrid() = default;

  /// Calls visit(photon) for all photons within the radius of the point, always in the same order.
  template <typename Visit>
  void each(Vec3 point, Visit&& visit) const noexcept;
  std::size_t size() const noexcept { return photons_.size(); }

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell_below(Vec3 point, double shift) const noexcept;
  std::uint32_t bucket(const Cell& cell) const noexcept;

  float radius_m_ = 0;
  std::vector<P> photons_;
  std::vector<std::uint32_t> first_;  ///< [bucket + 1]
};

using PhotonMap = PhotonGrid<Photon>;

template <typename P>
PhotonGrid<P>::PhotonGrid(std::vector<std::vector<P>>& parts, float radius_m)
    : radius_m_(radius_m) {
  std::size_t count = 0;
  for (const auto& part : parts) {
    count += part.size();
  }
  first_.assign(std::bit_ceil(std::max<std::size_t>(count, 16)) + 1, 0);
  for (const auto& part : parts) {
    for (const P& photon : part) {
      ++first_[bucket(cell_below(photon.position, 0))];
    }
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& first : first_) {
    sum += first;
    first = sum;
  }
  photons_.resize(count);
  // Goes backwards, so that the order is kept and first_ ends up at the beginnings.
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    for (auto photon = part->rbegin(); photon != part->rend(); ++photon) {
      photons_[--first_[bucket(cell_below(photon->position, 0))]] = *photon;
    }
    std::vector<P>().swap(*part);
  }
}

/// Cells are as wide as the diameter of the search sphere, so it overlaps at most two on each axis.
template <typename P>
typename PhotonGrid<P>::Cell PhotonGrid<P>::cell_below(Vec3 point, double shift) const noexcept {
  const double scale = 0.5 / static_cast<double>(radius_m_);
  const auto along = [=](float at) {
    return static_cast<std::int64_t>(std::floor(static_cast<double>(at) * scale - shift));
  };
  return {along(point.x), along(point.y), along(point.z)};
}

template <typename P>
std::uint32_t PhotonGrid<P>::bucket(const Cell& cell) const noexcept {
  // Teschner and others 2003, "Optimized Spatial Hashing", with 64-bit primes.
  std::uint64_t h = static_cast<std::uint64_t>(cell[0]) * 0x9e3779b97f4a7c15ULL;
  h ^= static_cast<std::uint64_t>(cell[1]) * 0xc2b2ae3d27d4eb4fULL;
  h ^= static_cast<std::uint64_t>(cell[2]) * 0x165667b19e3779f9ULL;
  h ^= h >> 32U;
  return static_cast<std::uint32_t>(h) & static_cast<std::uint32_t>(first_.size() - 2);
}

template <typename P>
template <typename Visit>
void PhotonGrid<P>::each(Vec3 point, Visit&& visit) const noexcept {
  if (photons_.empty()) {
    return;
  }
  const Cell low = cell_below(point, 0.5);
  std::array<std::uint32_t, 8> seen{};
  std::size_t count = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t b =
        bucket({low[0] + (corner & 1U), low[1] + ((corner >> 1U) & 1U), low[2] + (corner >> 2U)});
    bool is_new = true;  // cells may share a bucket
    for (std::size_t i = 0; i < count; ++i) {
      is_new = is_new && seen[i] != b;
    }
    if (!is_new) {
      continue;
    }
    seen[count++] = b;
    for (std::uint32_t i = first_[b]; i < first_[b + 1]; ++i) {
      const Vec3 d = photons_[i].position - point;
      if (dot(d, d) <= radius_m_ * radius_m_) {
        visit(photons_[i]);
      }
    }
  }
}

}  // namespace core
