#include "core/layers/layers.h"

#include <limits>
#include <utility>
#include <vector>

#include "core/error/pixel_error.h"

namespace core {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

FloatImage blank(const FilmSnapshot& film, std::vector<std::string> channels) {
  FloatImage image;
  image.width = film.rect.width;
  image.height = film.rect.height;
  image.channel_names = std::move(channels);
  image.values.resize(film.pixel_count() * image.channel_names.size());
  return image;
}

/// Variance of the mean, per channel: the raw half estimate, which adds up over a block.
Rgb raw_variance(const FilmSnapshot& film, std::size_t pixel) {
  const HalfValue a = half_value(film, pixel, 0);
  const HalfValue b = half_value(film, pixel, 1);
  if (a.count == 0 || b.count == 0) {
    return Rgb(kNan);
  }
  const Rgb d = a.mean - b.mean;
  return d * d * 0.25F;
}

template <typename Write>
FloatImage fill(const FilmSnapshot& film, std::vector<std::string> channels, Write&& write) {
  FloatImage image = blank(film, std::move(channels));
  const std::size_t stride = image.channel_names.size();
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    write(i, &image.values[i * stride]);
  }
  return image;
}

void put(float* out, Rgb c) {
  out[0] = c.r;
  out[1] = c.g;
  out[2] = c.b;
}

FloatImage error_layer(const FilmSnapshot& film) {
  FloatImage image = blank(film, {"Y"});
  image.values = relative_error_plane(film);
  return image;
}

Result<FloatImage> auxiliary(const FilmSnapshot& film, const std::string& name) {
  if (!film.has_aux) {
    return Error{ErrorCode::kInvalidArgument,
                 "the layer '" + name + "' was not recorded by this job", ""};
  }
  if (name == "albedo") {
    return fill(film, {"R", "G", "B"},
                [&](std::size_t i, float* out) { put(out, film.aux[i].albedo); });
  }
  if (name == "normal") {
    return fill(film, {"R", "G", "B"}, [&](std::size_t i, float* out) {
      const Vec3 n = film.aux[i].normal_world;
      put(out, {n.x, n.y, n.z});
    });
  }
  return fill(film, {"Y"}, [&](std::size_t i, float* out) { out[0] = film.aux[i].depth_m; });
}

}  // namespace

Result<FloatImage> layer_image(const FilmSnapshot& film, const std::string& name) {
  if (name == "beauty") {
    return fill(film, {"R", "G", "B", "A"}, [&](std::size_t i, float* out) {
      const HalfValue v = pixel_value(film, i);
      put(out, v.mean);
      out[3] = v.alpha;
    });
  }
  if (name == "alpha") {
    return fill(film, {"Y"},
                [&](std::size_t i, float* out) { out[0] = pixel_value(film, i).alpha; });
  }
  if (name == "samples") {
    return fill(film, {"Y"}, [&](std::size_t i, float* out) {
      out[0] = static_cast<float>(pixel_value(film, i).count);
    });
  }
  if (name == "variance") {
    return fill(film, {"R", "G", "B"},
                [&](std::size_t i, float* out) { put(out, raw_variance(film, i)); });
  }
  if (name == "error") {
    return error_layer(film);
  }
  if (name == "albedo" || name == "normal" || name == "depth") {
    return auxiliary(film, name);
  }
  return Error{ErrorCode::kInvalidArgument, "there is no layer '" + name + "'", ""};
}

FloatImage all_layers_image(const FilmSnapshot& film, const FilmSettings& settings) {
  std::vector<std::string> channels = {"R", "G", "B", "A"};
  const bool aux = film.has_aux;
  const auto add = [&channels](std::initializer_list<const char*> names) {
    channels.insert(channels.end(), names.begin(), names.end());
  };
  if (aux && settings.albedo) {
    add({"albedo.R", "albedo.G", "albedo.B"});
  }
  if (aux && settings.normal) {
    add({"normal.X", "normal.Y", "normal.Z"});
  }
  if (aux && settings.depth) {
    add({"depth.Z"});
  }
  add({"samples.Y", "variance.R", "variance.G", "variance.B", "error.Y"});
  const FloatImage error = error_layer(film);
  return fill(film, channels, [&](std::size_t i, float* out) {
    const HalfValue v = pixel_value(film, i);
    put(out, v.mean);
    out[3] = v.alpha;
    out += 4;
    if (aux && settings.albedo) {
      put(out, film.aux[i].albedo);
      out += 3;
    }
    if (aux && settings.normal) {
      const Vec3 n = film.aux[i].normal_world;
      put(out, {n.x, n.y, n.z});
      out += 3;
    }
    if (aux && settings.depth) {
      *out++ = film.aux[i].depth_m;
    }
    *out++ = static_cast<float>(v.count);
    put(out, raw_variance(film, i));
    out[3] = error.values[i];
  });
}

}  // namespace core
