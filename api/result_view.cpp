#include <array>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "api/job_view.h"
#include "api/requests.h"
#include "api/values.h"

namespace api {
namespace {

/// 0.975 quantile of Student's t. Table: NIST/SEMATECH e-Handbook 1.3.6.7.2; beyond it the
/// expansion in 1/df of Abramowitz and Stegun 26.7.5, whose error there is below 2e-4.
double student_t_975(std::size_t degrees) {
  constexpr std::array kTable = {12.7062, 4.3027, 3.1824, 2.7764, 2.5706,
                                 2.4469,  2.3646, 2.3060, 2.2622, 2.2281};
  if (degrees <= kTable.size()) {
    return kTable[degrees - 1];
  }
  constexpr double kZ = 1.959964;
  constexpr double kZ3 = kZ * kZ * kZ;
  constexpr double kZ5 = kZ3 * kZ * kZ;
  constexpr double kZ7 = kZ5 * kZ * kZ;
  const auto df = static_cast<double>(degrees);
  return kZ + (kZ3 + kZ) / (4 * df) + (5 * kZ5 + 16 * kZ3 + 3 * kZ) / (96 * df * df) +
         (3 * kZ7 + 19 * kZ5 + 17 * kZ3 - 15 * kZ) / (384 * df * df * df);
}

Json numbers_json(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) {
    list.push_back(number_json(value));
  }
  return list;
}

std::string picture_path(const std::string& id) {
  return (is_uuid(id) ? "/v1/jobs/" : "/v1/assets/") + id;
}

}  // namespace

Slope fit_slope(std::span<const core::ConvergencePoint> points) {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> x;
  std::vector<double> y;
  for (const core::ConvergencePoint& point : points) {
    const double error = point.error.relative_rmse;
    if (point.samples_per_pixel > 0 && std::isfinite(error) && error > 0) {
      x.push_back(std::log(static_cast<double>(point.samples_per_pixel)));
      y.push_back(std::log(error));
    }
  }
  const auto n = static_cast<double>(x.size());
  double mean_x = 0;
  double mean_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  double sxx = 0;
  double sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sxx += (x[i] - mean_x) * (x[i] - mean_x);
    sxy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  if (!(sxx > 0)) {
    return {unknown, unknown, unknown};
  }
  const double slope = sxy / sxx;
  if (x.size() < 3) {
    return {slope, unknown, unknown};
  }
  double residual = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double r = y[i] - mean_y - slope * (x[i] - mean_x);
    residual += r * r;
  }
  const double half_width = student_t_975(x.size() - 2) * std::sqrt(residual / (n - 2) / sxx);
  return {slope, slope - half_width, slope + half_width};
}

std::string convergence_json(std::span<const core::ConvergencePoint> points) {
  Json list = Json::array();
  for (const core::ConvergencePoint& point : points) {
    list.push_back({{"samples_per_pixel", point.samples_per_pixel},
                    {"elapsed_seconds", number_json(point.elapsed_seconds)},
                    {"cpu_seconds", number_json(point.cpu_seconds)},
                    {"rays", point.rays},
                    {"relative_rmse", number_json(point.error.relative_rmse)},
                    {"low", number_json(point.error.low)},
                    {"high", number_json(point.error.high)}});
  }
  const Slope slope = fit_slope(points);
  return dump({{"points", std::move(list)},
               {"slope",
                {{"value", number_json(slope.value)},
                 {"low", number_json(slope.low)},
                 {"high", number_json(slope.high)}}}});
}

std::string pixel_json(const PixelView& pixel) {
  Json layers = Json::object();
  for (const PixelLayer& layer : pixel.layers) {
    Json halves = Json::array();
    for (const auto& half : layer.halves) {
      halves.push_back(numbers_json(half));
    }
    layers[layer.name] = {{"mean", numbers_json(layer.mean)},
                          {"standard_error", numbers_json(layer.standard_error)},
                          {"low", numbers_json(layer.low)},
                          {"high", numbers_json(layer.high)},
                          {"halves", layer.halves.empty() ? Json(nullptr) : std::move(halves)}};
  }
  return dump(
      {{"x", pixel.x}, {"y", pixel.y}, {"samples", pixel.samples}, {"layers", std::move(layers)}});
}

std::string comparison_json(const ComparisonView& comparison) {
  const std::string self = "/v1/comparisons/" + comparison.id;
  return dump({{"id", comparison.id},
               {"mse", number_json(comparison.mse)},
               {"relmse", number_json(comparison.relmse)},
               {"flip", number_json(comparison.flip)},
               {"bias",
                {{"value", number_json(comparison.bias)},
                 {"low", number_json(comparison.bias_low)},
                 {"high", number_json(comparison.bias_high)}}},
               {"z",
                {{"mean", number_json(comparison.z_mean)},
                 {"variance", number_json(comparison.z_variance)},
                 {"share_above_3", number_json(comparison.z_share_above_3)}}},
               {"links",
                {{"self", self},
                 {"difference", self + "/difference.png"},
                 {"z", self + "/z.png"},
                 {"flip", self + "/flip.png"},
                 {"a", picture_path(comparison.a)},
                 {"b", picture_path(comparison.b)}}}});
}

}  // namespace api
