#include "core/textures/texture.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <immintrin.h>

namespace core {
namespace {

float srgb_to_linear(float c) {
  return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
}

float linear_to_srgb(float c) {
  return c <= 0.0031308F ? c * 12.92F : 1.055F * std::pow(c, 1 / 2.4F) - 0.055F;
}

std::array<float, 256> make_table(bool srgb) {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const float c = static_cast<float>(i) / 255.0F;
    table[i] = srgb ? srgb_to_linear(c) : c;
  }
  return table;
}

const std::array<float, 256> kLinearTable = make_table(false);
const std::array<float, 256> kSrgbTable = make_table(true);

Vec4 mix(Vec4 a, Vec4 b, float t) {
  return {a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t, a.z + (b.z - a.z) * t,
          a.w + (b.w - a.w) * t};
}

/// One channel of a stored pixel as [0,1] (integers) or as is (floats).
float stored(const Image& image, std::size_t index) {
  switch (image.type) {
    case PixelType::kU8:
      return static_cast<float>(std::to_integer<unsigned>(image.bytes[index])) / 255.0F;
    case PixelType::kU16: {
      std::uint16_t value = 0;
      std::memcpy(&value, &image.bytes[index * 2], 2);
      return static_cast<float>(value) / 65535.0F;
    }
    case PixelType::kF32:
      break;
  }
  float value = 0;
  std::memcpy(&value, &image.bytes[index * 4], 4);
  return value;
}

std::uint32_t to_byte(float c) {
  return static_cast<std::uint32_t>(std::clamp(c, 0.0F, 1.0F) * 255.0F + 0.5F);
}

}  // namespace

int wrapped_texel(int i, int n, TextureWrap mode) {
  if (static_cast<unsigned>(i) < static_cast<unsigned>(n)) {
    return i;
  }
  switch (mode) {
    case TextureWrap::kClampToEdge:
      return std::clamp(i, 0, n - 1);
    case TextureWrap::kMirroredRepeat: {
      const int period = 2 * n;
      const int m = ((i % period) + period) % period;
      return m < n ? m : period - 1 - m;
    }
    case TextureWrap::kRepeat:
      break;
  }
  return ((i % n) + n) % n;
}

Vec4 Texture::texel(const Level& level, int x, int y) const noexcept {
  const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) +
                  static_cast<std::size_t>(x);
  if (level.floats.empty()) {
    const std::uint32_t c = level.rgba8[at];
    const auto& table = srgb_ ? kSrgbTable : kLinearTable;
    return {table[c & 255U], table[(c >> 8) & 255U], table[(c >> 16) & 255U],
            kLinearTable[c >> 24]};
  }
  return level.floats[at];
}

std::shared_ptr<const Texture> Texture::create(const Image& image, bool srgb) {
  std::shared_ptr<Texture> texture(new Texture());
  const bool bytes = image.type == PixelType::kU8;
  texture->srgb_ = srgb && bytes;
  Level base;
  base.width = image.width;
  base.height = image.height;
  const auto count = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  const auto channels = static_cast<std::size_t>(image.channels);
  const bool grey = channels <= 2;
  const bool alpha = channels == 2 || channels == 4;
  if (bytes) {
    base.rgba8.resize(count);
  } else {
    base.floats.resize(count);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = i * channels;
    const std::size_t g = grey ? at : at + 1;
    const std::size_t b = grey ? at : at + 2;
    const std::size_t a = at + channels - 1;
    if (bytes) {
      const auto byte = [&image](std::size_t k) {
        return std::to_integer<std::uint32_t>(image.bytes[k]);
      };
      base.rgba8[i] = byte(at) | byte(g) << 8 | byte(b) << 16 | (alpha ? byte(a) : 255U) << 24;
    } else {
      const bool decode = srgb && image.type == PixelType::kU16;
      const auto value = [&](std::size_t k) {
        const float c = stored(image, k);
        return decode ? srgb_to_linear(c) : c;
      };
      base.floats[i] = {value(at), value(g), value(b), alpha ? stored(image, a) : 1.0F};
    }
  }
  texture->levels_.push_back(std::move(base));
  while (texture->levels_.back().width > 1 || texture->levels_.back().height > 1) {
    const Level& from = texture->levels_.back();
    Level to;
    to.width = std::max(1, from.width / 2);
    to.height = std::max(1, from.height / 2);
    const auto n = static_cast<std::size_t>(to.width) * static_cast<std::size_t>(to.height);
    (bytes ? to.rgba8.resize(n) : to.floats.resize(n));
    for (int y = 0; y < to.height; ++y) {
      for (int x = 0; x < to.width; ++x) {
        const int x0 = std::min(2 * x, from.width - 1);
        const int y0 = std::min(2 * y, from.height - 1);
        const int x1 = std::min(2 * x + 1, from.width - 1);
        const int y1 = std::min(2 * y + 1, from.height - 1);
        const Vec4 v =
            mix(mix(texture->texel(from, x0, y0), texture->texel(from, x1, y0), 0.5F),
                mix(texture->texel(from, x0, y1), texture->texel(from, x1, y1), 0.5F), 0.5F);
        const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(to.width) +
                        static_cast<std::size_t>(x);
        if (bytes) {
          const auto encode = [&](float c) {
            return to_byte(texture->srgb_ ? linear_to_srgb(c) : c);
          };
          to.rgba8[at] = encode(v.x) | encode(v.y) << 8 | encode(v.z) << 16 | to_byte(v.w) << 24;
        } else {
          to.floats[at] = v;
        }
      }
    }
    texture->levels_.push_back(std::move(to));
  }
  texture->mean_ = texture->texel(texture->levels_.back(), 0, 0);
  return texture;
}

Vec4 Texture::bilinear(const Level& level, const Lookup& at) const noexcept {
  const float x = at.uv.x * static_cast<float>(level.width) - 0.5F;
  const float y = at.uv.y * static_cast<float>(level.height) - 0.5F;
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const auto column = [&](int i) {
    return static_cast<std::size_t>(wrapped_texel(i, level.width, at.wrap_u));
  };
  const auto row = [&](int i) {
    return static_cast<std::size_t>(wrapped_texel(i, level.height, at.wrap_v)) *
           static_cast<std::size_t>(level.width);
  };
  const std::size_t x0 = column(static_cast<int>(fx));
  const std::size_t x1 = column(static_cast<int>(fx) + 1);
  const std::size_t y0 = row(static_cast<int>(fy));
  const std::size_t y1 = row(static_cast<int>(fy) + 1);
  // Four channels at once: this is most of what textures cost.
  const auto blend = [&](auto texel_at) {
    const auto between = [](__m128 a, __m128 b, float t) { return a + (b - a) * _mm_set1_ps(t); };
    const __m128 low = between(texel_at(y0 + x0), texel_at(y0 + x1), x - fx);
    const __m128 high = between(texel_at(y1 + x0), texel_at(y1 + x1), x - fx);
    Vec4 out;
    _mm_storeu_ps(&out.x, between(low, high, y - fy));
    return out;
  };
  static_assert(sizeof(Vec4) == sizeof(__m128));
  if (level.floats.empty()) {
    const float* table = (srgb_ ? kSrgbTable : kLinearTable).data();
    const float* alpha = kLinearTable.data();
    return blend([&](std::size_t i) {
      const std::uint32_t c = level.rgba8[i];
      return _mm_setr_ps(table[c & 255U], table[(c >> 8) & 255U], table[(c >> 16) & 255U],
                         alpha[c >> 24]);
    });
  }
  return blend([&](std::size_t i) { return _mm_loadu_ps(&level.floats[i].x); });
}

Vec4 Texture::sample(const Lookup& lookup) const noexcept {
  Lookup at = lookup;
  // Far-out coordinates would overflow the integer texel; NaN reads the first one.
  at.uv.x = std::fabs(at.uv.x) < 1e6F ? at.uv.x : 0.0F;
  at.uv.y = std::fabs(at.uv.y) < 1e6F ? at.uv.y : 0.0F;
  const auto w = static_cast<float>(levels_[0].width);
  const auto h = static_cast<float>(levels_[0].height);
  const Vec2 p = {at.across.x * w, at.across.y * h};
  const Vec2 q = {at.along.x * w, at.along.y * h};
  const float longest2 = std::max(dot(p, p), dot(q, q));
  if (!(longest2 > 1)) {
    if (at.nearest) {
      const Level& level = levels_[0];
      const int x = static_cast<int>(std::floor(at.uv.x * w));
      const int y = static_cast<int>(std::floor(at.uv.y * h));
      return texel(level, wrapped_texel(x, level.width, at.wrap_u),
                   wrapped_texel(y, level.height, at.wrap_v));
    }
    return bilinear(levels_[0], at);
  }
  if (!(longest2 < 1e14F)) {
    return mean_;
  }
  const float area = std::fabs(p.x * q.y - p.y * q.x);
  if (at.taps_max <= 1) {
    return trilinear(0.5F * std::log2(std::max(area, 1.0F)), at);
  }
  const float longest = std::sqrt(longest2);
  const float width = std::max({area / longest, longest / static_cast<float>(at.taps_max), 1.0F});
  const int taps = std::min(static_cast<int>(std::ceil(longest / width - 0.25F)), at.taps_max);
  const float lod = std::log2(width);
  if (taps <= 1) {
    return trilinear(lod, at);
  }
  const bool along = dot(q, q) > dot(p, p);
  const Vec2 way = along ? at.along : at.across;
  Vec4 sum = {0, 0, 0, 0};
  for (int i = 0; i < taps; ++i) {
    const float t = (static_cast<float>(i) + 0.5F) / static_cast<float>(taps) - 0.5F;
    Lookup tap = at;
    tap.uv = at.uv + way * t;
    const Vec4 c = trilinear(lod, tap);
    sum = {sum.x + c.x, sum.y + c.y, sum.z + c.z, sum.w + c.w};
  }
  const float share = 1 / static_cast<float>(taps);
  return {sum.x * share, sum.y * share, sum.z * share, sum.w * share};
}

Vec4 Texture::trilinear(float lod, const Lookup& at) const noexcept {
  const float clamped = std::clamp(lod, 0.0F, static_cast<float>(levels_.size() - 1));
  const auto low = static_cast<std::size_t>(clamped);
  const float blend = clamped - static_cast<float>(low);
  if (blend < 1e-3F || low + 1 >= levels_.size()) {
    return bilinear(levels_[low], at);
  }
  return mix(bilinear(levels_[low], at), bilinear(levels_[low + 1], at), blend);
}

std::size_t Texture::bytes() const noexcept {
  std::size_t sum = 0;
  for (const Level& level : levels_) {
    sum += level.rgba8.size() * sizeof(std::uint32_t) + level.floats.size() * sizeof(Vec4);
  }
  return sum;
}

}  // namespace core
