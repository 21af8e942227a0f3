#include "core/textures/texture.h"

#include <algorithm>
#include <cmath>

#include "core/color/srgb.h"
#include "core/image_io/radiance.h"
#include "core/math/area_cover.h"

namespace core {
namespace {

std::array<float, 256> make_table(bool srgb) {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const float c = static_cast<float>(i) / 255.0F;
    table[i] = srgb ? srgb_decoded(c) : c;
  }
  return table;
}

const std::array<float, 256> kLinearTable = make_table(false);
const std::array<float, 256> kSrgbTable = make_table(true);

Vec4 mix(Vec4 a, Vec4 b, float t) {
  return {a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t, a.z + (b.z - a.z) * t,
          a.w + (b.w - a.w) * t};
}

std::uint32_t to_byte(float c) {
  return static_cast<std::uint32_t>(std::clamp(c, 0.0F, 1.0F) * 255.0F + 0.5F);
}

/// Finds the nearest of 256 steps of the sRGB curve without evaluating its power.
class SrgbEncoder {
 public:
  SrgbEncoder() {
    for (std::size_t k = 0; k + 1 < least_.size(); ++k) {
      least_[k] = srgb_decoded((static_cast<float>(k) + 0.5F) / 255.0F);
    }
    least_.back() = 2;
    for (std::size_t i = 0; i < below_.size(); ++i) {
      below_[i] = static_cast<std::uint8_t>(
          to_byte(srgb_encoded(static_cast<float>(i) / static_cast<float>(kParts))));
    }
  }
  /// c: in [0, 1].
  std::uint32_t encode(float c) const {
    const std::uint32_t step = below_[static_cast<std::size_t>(c * static_cast<float>(kParts))];
    return step + (c >= least_[step] ? 1U : 0U);
  }

 private:
  /// A part contains at most one border of steps: where the curve is steepest, near black, a part
  /// is 12.92 * 255 / 4096 = 0.8 of a step.
  static constexpr std::size_t kParts = 4096;
  std::array<std::uint8_t, kParts + 1> below_{};  ///< the step at the part's lower end
  std::array<float, 256> least_{};                ///< of the next step
};
const SrgbEncoder kSrgbEncoder;

/// Averages four texels, each channel rounded.
std::uint32_t mean_of(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  constexpr std::uint32_t kEven = 0x00ff00ffU;
  const std::uint32_t even = (a & kEven) + (b & kEven) + (c & kEven) + (d & kEven) + 0x00020002U;
  const std::uint32_t odd =
      (a >> 8 & kEven) + (b >> 8 & kEven) + (c >> 8 & kEven) + (d >> 8 & kEven) + 0x00020002U;
  return (even >> 2 & kEven) | (odd >> 2 & kEven) << 8;
}

std::uint32_t srgb_mean_of(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  std::uint32_t out = mean_of(a, b, c, d) & 0xff000000U;
  for (unsigned shift = 0; shift < 24; shift += 8) {
    const auto linear = [shift](std::uint32_t t) { return kSrgbTable[t >> shift & 255U]; };
    out |= kSrgbEncoder.encode(0.25F * ((linear(a) + linear(b)) + (linear(c) + linear(d))))
           << shift;
  }
  return out;
}

Vec4 float_mean_of(Vec4 a, Vec4 b, Vec4 c, Vec4 d) {
  return mix(mix(a, b, 0.5F), mix(c, d, 0.5F), 0.5F);
}

/// value(texel): linear; texel(value): rounds it.
template <typename Texel, typename Value, typename ToTexel>
PagedVector<Texel> halved_by_area(const PagedVector<Texel>& from, int width, int height,
                                  const Value& value, const ToTexel& texel) {
  const std::vector<AreaCover> columns = area_covers(width, std::max(1, width / 2));
  const std::vector<AreaCover> rows = area_covers(height, std::max(1, height / 2));
  PagedVector<Texel> to;
  to.reserve(columns.size() * rows.size());
  for (const AreaCover& row : rows) {
    for (const AreaCover& column : columns) {
      Vec4 sum = {0, 0, 0, 0};
      for_each_covered(column, row, [&](int x, int y, float share) {
        const Vec4 v = value(from[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(x)]);
        sum = {sum.x + v.x * share, sum.y + v.y * share, sum.z + v.z * share, sum.w + v.w * share};
      });
      to.push_back(texel(sum));
    }
  }
  return to;
}

/// As halved_by_area() for even sizes, without multiplications. Pre: each size is even or 1.
template <typename Texel, typename Mean>
PagedVector<Texel> halved(const PagedVector<Texel>& from, int width, int height, const Mean& mean) {
  const int half_width = std::max(1, width / 2);
  const int half_height = std::max(1, height / 2);
  PagedVector<Texel> to(static_cast<std::size_t>(half_width) *
                        static_cast<std::size_t>(half_height));
  const auto row_of = [&](int y) {
    return from.data() +
           static_cast<std::size_t>(std::min(y, height - 1)) * static_cast<std::size_t>(width);
  };
  const int step = width > 1 ? 1 : 0;
  for (int y = 0; y < half_height; ++y) {
    const Texel* upper = row_of(2 * y);
    const Texel* lower = row_of(2 * y + 1);
    Texel* out = to.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(half_width);
    for (int x = 0; x < half_width; ++x, upper += 2, lower += 2) {
      out[x] = mean(upper[0], upper[step], lower[0], lower[step]);
    }
  }
  return to;
}

bool is_odd(int size) { return size > 1 && size % 2 == 1; }

Vec4 unpacked(std::uint32_t c, bool srgb) {
  const auto& table = srgb ? kSrgbTable : kLinearTable;
  return {table[c & 255U], table[(c >> 8) & 255U], table[(c >> 16) & 255U], kLinearTable[c >> 24]};
}

std::uint32_t packed(Vec4 v, bool srgb) {
  const auto byte = [srgb](float c) {
    return srgb ? kSrgbEncoder.encode(std::min(c, 1.0F)) : to_byte(c);
  };
  return byte(v.x) | byte(v.y) << 8U | byte(v.z) << 16U | to_byte(v.w) << 24U;
}

template <typename Texel>
Vec4 mean_of_texels(int width, int height, const Texel& texel) {
  std::array<double, 4> sum{};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vec4 v = texel(x, y);
      sum[0] += static_cast<double>(v.x);
      sum[1] += static_cast<double>(v.y);
      sum[2] += static_cast<double>(v.z);
      sum[3] += static_cast<double>(v.w);
    }
  }
  const double count = static_cast<double>(width) * static_cast<double>(height);
  const auto share = [&](std::size_t c) { return static_cast<float>(sum[c] / count); };
  return {share(0), share(1), share(2), share(3)};
}

/// 8-bit pixels as RGBA.
template <std::size_t kChannels>
void pack(const std::byte* from, PagedVector<std::uint32_t>& to) {
  constexpr bool kGrey = kChannels <= 2;
  for (std::uint32_t& texel : to) {
    const auto byte = [from](std::size_t k) { return std::to_integer<std::uint32_t>(from[k]); };
    const std::uint32_t alpha = kChannels % 2 == 0 ? byte(kChannels - 1) : 255U;
    texel = byte(0) | byte(kGrey ? 0 : 1) << 8 | byte(kGrey ? 0 : 2) << 16 | alpha << 24;
    from += kChannels;
  }
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
  return level.floats.empty() ? unpacked(level.rgba8[at], srgb_) : level.floats[at];
}

PagedVector<Vec4> linear_texels(const Image& image, bool srgb) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const bool grey = channels <= 2;
  const bool alpha = channels == 2 || channels == 4;
  const bool decode = srgb && image.type != PixelType::kF32;
  const auto value = [&](std::size_t k) {
    const float c = stored_value(image, k);
    return decode ? srgb_decoded(c) : c;
  };
  PagedVector<Vec4> texels(image.value_count() / channels);
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const std::size_t at = i * channels;
    texels[i] = {value(at), value(grey ? at : at + 1), value(grey ? at : at + 2),
                 alpha ? stored_value(image, at + channels - 1) : 1.0F};
  }
  return texels;
}

std::shared_ptr<const Texture> Texture::create(const Image& image, bool srgb) {
  std::shared_ptr<Texture> texture(new Texture());
  const bool bytes = image.type == PixelType::kU8;
  texture->srgb_ = srgb && bytes;
  Level base;
  base.width = image.width;
  base.height = image.height;
  if (bytes) {
    base.rgba8.resize(image.value_count() / static_cast<std::size_t>(image.channels));
    const auto packs = {&pack<1>, &pack<2>, &pack<3>, &pack<4>};
    packs.begin()[image.channels - 1](image.bytes.data(), base.rgba8);
    texture->is_opaque_ = std::all_of(base.rgba8.begin(), base.rgba8.end(),
                                      [](std::uint32_t c) { return c >> 24 == 255; });
  } else {
    base.floats = linear_texels(image, srgb);
    texture->is_opaque_ =
        std::all_of(base.floats.begin(), base.floats.end(), [](const Vec4& c) { return c.w == 1; });
  }
  texture->levels_.push_back(std::move(base));
  const bool is_srgb = texture->srgb_;
  while (texture->levels_.back().width > 1 || texture->levels_.back().height > 1) {
    const Level& from = texture->levels_.back();
    const bool by_area = is_odd(from.width) || is_odd(from.height);
    Level to;
    to.width = std::max(1, from.width / 2);
    to.height = std::max(1, from.height / 2);
    if (!bytes && by_area) {
      const auto same = [](Vec4 v) { return v; };
      to.floats = halved_by_area(from.floats, from.width, from.height, same, same);
    } else if (!bytes) {
      to.floats = halved(from.floats, from.width, from.height, float_mean_of);
    } else if (by_area) {
      to.rgba8 = halved_by_area(
          from.rgba8, from.width, from.height,
          [is_srgb](std::uint32_t c) { return unpacked(c, is_srgb); },
          [is_srgb](Vec4 v) { return packed(v, is_srgb); });
    } else {
      to.rgba8 = halved(from.rgba8, from.width, from.height, is_srgb ? srgb_mean_of : mean_of);
    }
    texture->levels_.push_back(std::move(to));
  }
  texture->mean_ = mean_of_texels(image.width, image.height, [&texture](int x, int y) {
    return texture->texel(texture->levels_.front(), x, y);
  });
  set_aside(image.bytes);
  for (const Level& level : texture->levels_) {
    set_aside(level.rgba8);
    set_aside(level.floats);
  }
  return texture;
}

void Texture::find_taps(const Lookup& lookup, Taps& taps) const noexcept {
  const auto near = [](float u) { return std::fabs(u) < kTextureFarOut ? u : 0.0F; };
  const auto known = [](Vec2 way) { return way == way ? way : Vec2{0, 0}; };
  const TextureLookup<float> at = {.uv = {near(lookup.uv.x), near(lookup.uv.y)},
                                   .across = known(lookup.across),
                                   .along = known(lookup.along),
                                   .is_sharp = lookup.taps_max > 1,
                                   .wrap_u = static_cast<int>(lookup.wrap_u),
                                   .wrap_v = static_cast<int>(lookup.wrap_v),
                                   .width = width(),
                                   .height = height(),
                                   .levels = level_count()};
  const auto is_magnified = [](Vec2 way) { return dot(way, way) <= 1; };
  if (lookup.nearest && is_magnified(at.across_texels()) && is_magnified(at.along_texels())) {
    const auto texel = [](float u, int n, TextureWrap mode) {
      return wrapped_texel(floor_of(u * static_cast<float>(n)), n, mode);
    };
    const int i =
        texel(at.uv.y, height(), lookup.wrap_v) * width() + texel(at.uv.x, width(), lookup.wrap_u);
    taps.tap[0] = {0, i, i, i, i, 0, 0, 1};
    taps.count = 1;
    return;
  }
  taps.count = 0;
  core::find_taps(at, true, [&taps](bool, const Taps::Tap& tap) {
    taps.tap[static_cast<std::size_t>(taps.count++)] = tap;
  });
}

// Four channels at once: this is most of the cost of textures.
template <typename TexelAt>
__m128 Texture::sum(const Taps& taps, const TexelAt& texel_at) const noexcept {
  const auto between = [](__m128 a, __m128 b, __m128 t) { return a + (b - a) * t; };
  __m128 sum = _mm_setzero_ps();
  for (int i = 0; i < taps.count; ++i) {
    const Taps::Tap& tap = taps.tap[static_cast<std::size_t>(i)];
    const Level& level = levels_[static_cast<std::size_t>(tap.level)];
    const auto at = [&](int texel) { return texel_at(level, static_cast<std::size_t>(texel)); };
    const __m128 right = _mm_set1_ps(tap.right);
    const __m128 upper = between(at(tap.i00), at(tap.i10), right);
    const __m128 lower = between(at(tap.i01), at(tap.i11), right);
    sum += between(upper, lower, _mm_set1_ps(tap.down)) * _mm_set1_ps(tap.weight);
  }
  return sum;
}

Vec4 Texture::read(const Taps& taps) const noexcept {
  static_assert(sizeof(Vec4) == sizeof(__m128));
  if (taps.count == 0) {
    return mean_;
  }
  __m128 sum_of;
  if (!levels_[0].floats.empty()) {
    sum_of = sum(
        taps, [](const Level& level, std::size_t i) { return _mm_loadu_ps(&level.floats[i].x); });
  } else if (srgb_) {
    const float* table = kSrgbTable.data();
    const float* alpha = kLinearTable.data();
    sum_of = sum(taps, [&](const Level& level, std::size_t i) {
      const std::uint32_t c = level.rgba8[i];
      return _mm_setr_ps(table[c & 255U], table[(c >> 8) & 255U], table[(c >> 16) & 255U],
                         alpha[c >> 24]);
    });
  } else {
    sum_of = sum(taps, [](const Level& level, std::size_t i) {
      const __m128i bytes = _mm_cvtsi32_si128(static_cast<int>(level.rgba8[i]));
      return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(bytes));
    });
    sum_of *= _mm_set1_ps(1.0F / 255);
  }
  Vec4 out;
  _mm_storeu_ps(&out.x, sum_of);
  return out;
}

std::size_t Texture::bytes() const noexcept {
  std::size_t sum = 0;
  for (const Level& level : levels_) {
    sum += resident_bytes(level.rgba8) + resident_bytes(level.floats);
  }
  return sum;
}

}  // namespace core
