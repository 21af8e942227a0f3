#include "core/integrators/maps/irradiance_cache.h"

#include <algorithm>
#include <cmath>

#include "core/math/numbers.h"

namespace core {
namespace {

/// Records are placed closer together than their radii, so that several are averaged everywhere and
/// none ends abruptly.
constexpr float kOverlap = 1.4F;

/// Makes cells slightly wider than the spheres, so that a sphere overlaps one or two cells per axis
/// despite rounding.
constexpr float kCellSlack = 1.001F;

Vec3 around(float phi) noexcept { return {std::cos(phi), std::sin(phi), 0}; }

/// Adds a vector weighted by each channel of a colour.
void add(std::array<Vec3, 3>& to, Vec3 direction, Rgb by) noexcept {
  for (int c = 0; c < 3; ++c) {
    to[static_cast<std::size_t>(c)] += direction * by[c];
  }
}

Rgb dot_each(const std::array<Vec3, 3>& gradient, Vec3 d) noexcept {
  return {dot(gradient[0], d), dot(gradient[1], d), dot(gradient[2], d)};
}

/// Returns the mean of tan(theta) over the ring's part of the projected hemisphere: x =
/// sin^2(theta).
float mean_tangent(int ring, int rings) noexcept {
  const auto integral = [rings](int j) {
    const double x = static_cast<double>(j) / rings;
    return std::asin(std::sqrt(x)) - std::sqrt(x * (1 - x));
  };
  return static_cast<float>((integral(ring + 1) - integral(ring)) * rings);
}

/// One axis of a cell in 21 bits: cells 2^21 apart share an index entry, but their records are too
/// far away to be used.
std::uint64_t along(float at, int exponent, int step = 0) noexcept {
  const double cell = std::floor(std::ldexp(static_cast<double>(at), -exponent));
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + step) & 0x1FFFFFU;
}

std::uint64_t packed(std::uint64_t x, std::uint64_t y, std::uint64_t z) noexcept {
  return x << 42U | y << 21U | z;
}

int level_of(float reach_m) noexcept {
  int exponent = 0;
  std::frexp(2 * reach_m * kCellSlack, &exponent);
  return exponent;
}

}  // namespace

HemisphereGrid::HemisphereGrid(int rays) noexcept
    : rings_(std::max(2, static_cast<int>(std::lround(std::sqrt(static_cast<float>(rays) / kPi))))),
      sectors_(std::max(4, rays / rings_)) {}

Vec3 HemisphereGrid::direction(int i, Vec2 u) const noexcept {
  const int ring = i / sectors_;
  const int sector = i % sectors_;
  const float sine2 =
      std::min((static_cast<float>(ring) + u.x) / static_cast<float>(rings_), kOneMinusEpsilon);
  const float phi = kTwoPi * (static_cast<float>(sector) + u.y) / static_cast<float>(sectors_);
  const float sine = std::sqrt(sine2);
  return {sine * std::cos(phi), sine * std::sin(phi), std::sqrt(1 - sine2)};
}

HemisphereLight gathered(const HemisphereGrid& grid, std::span<const HemisphereSample> samples) {
  const int rings = grid.rings();
  const int sectors = grid.sectors();
  const float cell = kPi / static_cast<float>(grid.size());
  const float turn = kTwoPi / static_cast<float>(sectors);
  const auto at = [&](int ring, int sector) -> const HemisphereSample& {
    return samples[static_cast<std::size_t>(ring * sectors + sector)];
  };
  const auto sine = [rings](int ring) {
    return std::sqrt(static_cast<float>(ring) / static_cast<float>(rings));
  };
  HemisphereLight out;
  double inverse = 0;
  for (int j = 0; j < rings; ++j) {
    const float tangent = mean_tangent(j, rings);
    const float inner = sine(j);
    const float cos2_inner = 1 - inner * inner;
    for (int k = 0; k < sectors; ++k) {
      const HemisphereSample& here = at(j, k);
      const float middle = turn * (static_cast<float>(k) + 0.5F);
      out.irradiance += here.radiance * cell;
      inverse += 1 / static_cast<double>(here.distance_m);
      // n x d = sin(theta) around(phi + pi / 2), divided by the cosine of the sample's density.
      add(out.gradients.by_turn, around(middle + kPi / 2), here.radiance * (cell * tangent));
      if (j > 0) {
        const HemisphereSample& below = at(j - 1, k);
        const float nearer = std::min(here.distance_m, below.distance_m);
        add(out.gradients.by_move, around(middle),
            (here.radiance - below.radiance) * (turn * inner * cos2_inner / nearer));
      }
      const HemisphereSample& beside = at(j, (k + sectors - 1) % sectors);
      const float nearer = std::min(here.distance_m, beside.distance_m);
      add(out.gradients.by_move, around(turn * static_cast<float>(k) + kPi / 2),
          (here.radiance - beside.radiance) * ((sine(j + 1) - inner) / nearer));
    }
  }
  out.mean_distance_m = static_cast<float>(grid.size() / inverse);
  return out;
}

void limit_radius(IrradianceRecord& record, float least_m, float most_m) noexcept {
  const Vec3 slope = record.gradients.by_move[0] * kLuminance<float>[0] +
                     record.gradients.by_move[1] * kLuminance<float>[1] +
                     record.gradients.by_move[2] * kLuminance<float>[2];
  const float steepness = length(slope);
  float radius_m = record.radius_m;
  if (steepness > 0) {
    radius_m = std::min(radius_m, luminance(record.irradiance) / steepness);
  }
  if (radius_m < least_m) {
    for (Vec3& gradient : record.gradients.by_move) {
      gradient = gradient * (radius_m / least_m);
    }
  }
  record.radius_m = std::clamp(radius_m, least_m, most_m);
}

template <typename Visit>
void IrradianceCache::each_near(Vec3 point, Visit&& visit) const noexcept {
  for (const Level& level : levels_) {
    const std::uint64_t cell =
        packed(along(point.x, level.exponent), along(point.y, level.exponent),
               along(point.z, level.exponent));
    const auto end = entries_.begin() + level.last;
    auto entry = std::lower_bound(entries_.begin() + level.first, end, cell,
                                  [](const Entry& e, std::uint64_t c) { return e.cell < c; });
    for (; entry != end && entry->cell == cell; ++entry) {
      visit(entry->record);
    }
  }
}

template <typename Visit>
void IrradianceCache::each(Vec3 point, Vec3 normal, int scatterings, Visit&& visit) const noexcept {
  each_near(point, [&](std::uint32_t i) {
    const IrradianceRecord& record = records_[i];
    const Vec3 d = point - record.position;
    const float error = length(d) / record.radius_m + safe_sqrt(1 - dot(normal, record.normal));
    // Rejects records in front of the point, which see what the point cannot.
    constexpr float kInFront = 0.05F;
    const bool is_in_front = dot(d, normal + record.normal) * 0.5F < -kInFront * record.radius_m;
    if (error < tolerance_ && record.scatterings == scatterings && !is_in_front) {
      visit(record, error);
    }
  });
}

std::optional<Rgb> IrradianceCache::find(Vec3 point, Vec3 normal, int scatterings) const noexcept {
  Rgb sum;
  float weights = 0;
  each(point, normal, scatterings, [&](const IrradianceRecord& record, float error) {
    const float weight = 1 - error / tolerance_;
    const Rgb here = record.irradiance +
                     dot_each(record.gradients.by_turn, cross(record.normal, normal)) +
                     dot_each(record.gradients.by_move, point - record.position);
    sum += here * weight;
    weights += weight;
  });
  if (!(weights > 0)) {
    return std::nullopt;
  }
  const Rgb mean = sum * (1 / weights);
  return Rgb{std::max(mean.r, 0.0F), std::max(mean.g, 0.0F), std::max(mean.b, 0.0F)};
}

bool IrradianceCache::covers(Vec3 point, Vec3 normal, int scatterings) const noexcept {
  bool found = false;
  each(point, normal, scatterings, [&](const IrradianceRecord&, float error) {
    found = found || error * kOverlap < tolerance_;
  });
  return found;
}

void IrradianceCache::insert(std::span<const IrradianceRecord> records) {
  for (const IrradianceRecord& record : records) {
    const auto added = static_cast<std::uint32_t>(records_.size());
    records_.push_back(record);
    IrradianceRecord& here = records_[added];
    // Records of the same call are not in the index yet; a later record finds both.
    each_near(here.position, [&](std::uint32_t i) {
      IrradianceRecord& other = records_[i];
      const float apart_m = length(other.position - here.position);
      here.radius_m = std::min(here.radius_m, other.radius_m + apart_m);
      other.radius_m = std::min(other.radius_m, here.radius_m + apart_m);
    });
  }
  index();
}

void IrradianceCache::index() {
  std::vector<int> exponents;
  for (const IrradianceRecord& record : records_) {
    exponents.push_back(level_of(tolerance_ * record.radius_m));
  }
  std::vector<int> used = exponents;
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  entries_.clear();
  levels_.clear();
  for (const int exponent : used) {
    const auto first = static_cast<std::uint32_t>(entries_.size());
    for (std::uint32_t i = 0; i < records_.size(); ++i) {
      if (exponents[i] != exponent) {
        continue;
      }
      const IrradianceRecord& record = records_[i];
      const float reach = tolerance_ * record.radius_m * kCellSlack;
      std::array<std::array<std::uint64_t, 2>, 3> cells{};
      for (int axis = 0; axis < 3; ++axis) {
        const float at = record.position[axis];
        cells[static_cast<std::size_t>(axis)] = {along(at - reach, exponent),
                                                 along(at + reach, exponent)};
      }
      for (int corner = 0; corner < 8; ++corner) {
        const auto pick = [&](int axis) {
          return cells[static_cast<std::size_t>(axis)]
                      [static_cast<std::size_t>((corner >> axis) & 1)];
        };
        entries_.push_back({packed(pick(0), pick(1), pick(2)), i});
      }
    }
    const auto by_cell = [](const Entry& a, const Entry& b) {
      return a.cell != b.cell ? a.cell < b.cell : a.record < b.record;
    };
    const auto same = [](const Entry& a, const Entry& b) {
      return a.cell == b.cell && a.record == b.record;
    };
    std::sort(entries_.begin() + first, entries_.end(), by_cell);
    entries_.erase(std::unique(entries_.begin() + first, entries_.end(), same), entries_.end());
    levels_.push_back({exponent, first, static_cast<std::uint32_t>(entries_.size())});
  }
}

}  // namespace core
