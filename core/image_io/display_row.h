/// DisplayRow: the rows of PNG, JPEG, WebP and AVIF files.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include "core/color/white_balance.h"
#include "core/image_io/image_io.h"

namespace core {

/// Returns whether an image with alpha is written without.
inline bool drops_alpha(const ImageRows& image, const ImageFormat& format,
                        const EncodeOptions& options) {
  return image.channels() == 4 && (!format.has_alpha || options.background);
}

/// Converts rows for display: exposure, division by alpha, white balance, contrast, tone map and
/// rounding. Data is only clipped.
class DisplayRow {
 public:
  DisplayRow(const ImageRows& image, const ImageFormat& format, const EncodeOptions& options)
      : channels_(image.channels()),
        background_(options.background.value_or(Rgb(1))),
        channels_out_(drops_alpha(image, format, options) ? 3 : image.channels()),
        gain_(options.is_color ? std::exp2(options.exposure_stops) : 1.0F),
        contrast_(options.is_color ? options.contrast : 1),
        tone_map_(options.is_color ? options.tone_map : ToneMap::kLinear),
        is_before_(channels_ == 4 && channels_out_ == 3) {
    if (options.is_color && options.white_kelvin) {
      white_balance_.emplace(*options.white_kelvin);
    }
    if (channels_ == 1 && (format.extension == "webp" || format.extension == "avif")) {
      channels_out_ = 3;  // they have no grey
    }
  }

  /// Of the file.
  int channels() const noexcept { return channels_out_; }
  /// Writes a row of `width` pixels.
  template <typename Value>
  void write(const float* in, int width, Value* to) const {
    for (int x = 0; x < width; ++x) {
      to = write_pixel(in, to);
      in += channels_;
    }
  }

 private:
  template <typename Value>
  Value* write_pixel(const float* in, Value* to) const {
    const float alpha = channels_ == 4 ? in[3] : 1.0F;
    const float scale = channels_ == 4 && alpha > 0 ? gain_ / alpha : gain_;
    if (channels_ == 1) {
      const auto grey = quantize<Value>(apply_tone_map(tone_map_, adjusted(Rgb(in[0] * scale))).r);
      return std::fill_n(to, channels_out_, grey);
    }
    const Rgb linear = adjusted(Rgb{in[0], in[1], in[2]} * scale);
    if (std::is_same_v<Value, std::uint8_t> && tone_map_ != ToneMap::kLinear && !is_before_) {
      const Rgb c = before_srgb_curve(tone_map_, linear);
      *to++ = srgb_byte(c.r);
      *to++ = srgb_byte(c.g);
      *to++ = srgb_byte(c.b);
      return with_alpha(alpha, to);
    }
    Rgb c = apply_tone_map(tone_map_, linear);
    if (is_before_) {
      // Blends display values, as a browser does.
      const float a = std::isnan(alpha) ? 0.0F : std::clamp(alpha, 0.0F, 1.0F);
      const auto blend = [a](float front, float back) {
        return (a > 0 ? a * std::clamp(front, 0.0F, 1.0F) : 0.0F) + (1 - a) * back;
      };
      c = {blend(c.r, background_.r), blend(c.g, background_.g), blend(c.b, background_.b)};
    }
    *to++ = quantize<Value>(c.r);
    *to++ = quantize<Value>(c.g);
    *to++ = quantize<Value>(c.b);
    return with_alpha(alpha, to);
  }

  /// Value: std::uint8_t or std::uint16_t.
  template <typename Value>
  static Value quantize(float v) noexcept {
    constexpr auto kMost = static_cast<float>(std::numeric_limits<Value>::max());
    return static_cast<Value>(std::lround(std::clamp(v, 0.0F, 1.0F) * kMost));
  }
  template <typename Value>
  Value* with_alpha(float alpha, Value* to) const {
    if (channels_out_ == 4) {
      *to++ = std::isnan(alpha) ? Value{0} : quantize<Value>(alpha);
    }
    return to;
  }
  Rgb adjusted(Rgb linear) const {
    if (white_balance_) {
      linear = (*white_balance_)(linear);
    }
    if (contrast_ != 1) {
      linear = {contrasted(linear.r), contrasted(linear.g), contrasted(linear.b)};
    }
    return linear;
  }
  float contrasted(float v) const {
    constexpr float kMiddleGrey = 0.18F;
    return v > 0 ? kMiddleGrey * std::pow(v / kMiddleGrey, contrast_) : v;
  }

  int channels_;
  Rgb background_;
  int channels_out_;
  float gain_;
  std::optional<WhiteBalance> white_balance_;
  float contrast_;
  ToneMap tone_map_;
  bool is_before_;
};

}  // namespace core
